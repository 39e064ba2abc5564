return {
  name = "euler", order = 1,
  text = "Explicit Euler: one slope per step, for demonstrations.",
  cite = "Euler, Institutionum calculi integralis, 1768, §650",
  c = { 0 },
  A = { {} },
  b = { 1 },
}

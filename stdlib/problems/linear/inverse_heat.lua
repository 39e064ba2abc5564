return {
  title = "Inverse heat conduction: the flux that makes the far end follow a course",
  source = "constructed for this library; the kind: Campbell, SIAM J. Sci. Comput. 16(4), 1995",
  statement = [[The heat equation in five cells, the temperature of the last one prescribed, the flux into the
    first one unknown. Every cell between them costs a differentiation: Hessenberg form of size 6.]],
  tags = "linear control",
  index = 6, dof = 0, structural_index = 6, structural_dof = 0, verdict = "valid",
  to = 1, dt = 0.1,
  build = function()
    local T, u = var("T", 5), var "u"
    local e, f = { [5] = t^3 }, {}
    e[4] = 3*t^2 + e[5]
    for k = 3, 0, -1 do e[k] = diff(e[k+1], t) + 2*e[k+1] - e[k+2] end   -- T_k from T_{k+1}; T_0 is the flux
    local exact = { [u] = expand(e[0]) }
    for k = 1, 5 do exact[T[k]] = expand(e[k]) end
    for k = 1, 4 do f[k] = der(T[k]) ~ (k > 1 and T[k-1] or u) - 2*T[k] + T[k+1] end
    f[5] = der(T[5]) ~ T[4] - T[5]
    f[6] = 0 ~ T[5] - t^3
    f.name = "inverse heat conduction"
    return {
      model = dae(f),
      constraints = { T[5] - t^3, T[4] - e[4], T[3] - e[3], T[2] - e[2], T[1] - e[1] },
      fix = {},
      exact = exact,
    }
  end,
}

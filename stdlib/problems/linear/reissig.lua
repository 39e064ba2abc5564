return {
  title = "Index 1 with structural index 3",
  source = "Reißig, Martinson & Barton, SIAM J. Sci. Comput. 21(6), 2000",
  statement = [[Of this kind are systems of index 1 whose structural index is as large as one likes. The
    numbers in the leading coefficients cancel, so that fewer differentiations are needed than the pattern
    suggests.]],
  tags = "linear failure",
  index = 1, dof = 2, structural_index = 3, structural_dof = 2, verdict = "valid",
  remark = [[Structure is right about the free values and gives only an upper bound of the index: (1) - (2)
    and (3) - (4) are free of derivatives.]],
  to = 1, dt = 0.1,
  build = function()
    local x1, x2, x3, x4, x5 = vars "x1 x2 x3 x4 x5"
    local f = input("f", 5)
    local e4 = exp(-t) - 2*t + 2
    local e2 = (cos(t) + sin(t))/2 + 1 + t*exp(-t)
    return {
      model = dae { der(x2) + der(x3) + x1 ~ f[1], der(x2) + der(x3) + x2 ~ f[2],
        der(x4) + der(x5) + x3 ~ f[3],
        der(x4) + der(x5) + x4 ~ f[4], x5 ~ f[5], name = "structural index 3, index 1" },
      constraints = { x5 - f[5], x3 - x4 - f[3] + f[4] },
      fix = { [x2] = 3/2, [x4] = 3 },
      inputs = { [f[1]] = sin(t), [f[2]] = cos(t), [f[3]] = t, [f[4]] = 0, [f[5]] = t^2 },
      exact = { [x1] = e2 + sin(t) - cos(t), [x2] = e2, [x3] = e4 + t, [x4] = e4, [x5] = t^2 },
    }
  end,
}

return {
  title = "Two-link robot arm with a flexible joint, on a prescribed path",
  source = [[Campbell & Griepentrog, SIAM J. Sci. Comput. 16, 1995, after De Luca & Isidori; form of Pryce,
    BIT 41(2), 2001]],
  statement = [[The torques u₁, u₂ that carry the tip along a path. Equations (1) and (3) contain them only as
    u₁ - u₂: a new variable for that repairs the structure. x₂ follows from x₁″ and x₃″, the torques from x₂″:
    five differentiations in all.]],
  tags = "nonlinear mechanics control failure",
  index = 5, dof = 0, structural_index = 3, structural_dof = 2, verdict = "identically singular",
  remark = [[The columns of u₁ and u₂ in equations (1) and (3) are opposite, so the structure takes one torque
    for what gives x₂.]],
  to = 0.5, dt = 0.025,
  build = function()
    local x1, x2, x3, u1, u2 = vars "x1 x2 x3 u1 u2"
    local function coefficients(x)
      local below = 2 - cos(x)^2
      return 2/below, cos(x)/below, sin(x)/below, cos(x)*sin(x)/below
    end
    local function sides(x1, x2, x3, u1, u2)
      local a, b, c, d = coefficients(x3)
      local v1, v13, s = der(x1), der(x1) + der(x3), 2*x3 - x2
      return 2*c*v13^2 + v1^2*d + s*(a + 2*b) + a*(u1 - u2),
        -2*c*v13^2 - v1^2*d + s*(1 - 3*a - 2*b) - a*u1 + (a + 1)*u2,
        -2*c*v13^2 - v1^2*d + s*(a - 9*b) - 2*v1^2*c - d*v13^2 - (a + b)*(u1 - u2)
    end
    -- the path belongs to x₁ = 1 - eᵗ, x₃ = eᵗ - t; then (1) and (3) give s = 2 x₃ - x₂ and w = u₁ - u₂, (2)
    -- gives u₂
    local e1, e3 = 1 - exp(t), exp(t) - t
    local a, b = coefficients(e3)
    local free1, _, free3 = sides(e1, 2*e3, e3, 0, 0)
    local r1, r3 = der(e1, 2) - free1, der(e3, 2) - free3
    local det = -(a + 2*b)*(a + b) - a*(a - 9*b)
    local s, w = (-(a + b)*r1 - a*r3)/det, ((a + 2*b)*r3 - (a - 9*b)*r1)/det
    local e2 = 2*e3 - s
    local _, rest = sides(e1, e2, e3, w, 0)
    local torque = der(e2, 2) - rest                   -- -a (u₂ + w) + (a + 1) u₂ = -a w + u₂
    local f1, f2, f3 = sides(x1, x2, x3, u1, u2)
    local g1, g2 = cos(x1) + cos(x1 + x3) - cos(1 - exp(t)) - cos(1 - t),
      sin(x1) + sin(x1 + x3) - sin(1 - exp(t)) - sin(1 - t)
    return {
      model = dae { der(x1, 2) ~ f1, der(x2, 2) ~ f2, der(x3, 2) ~ f3, 0 ~ g1, 0 ~ g2, name = "robot arm" },
      constraints = { g1, g2, der(g1), der(g2), x2 - e2, x2.dot - der(e2) },
      guess = { [x1] = 0, [x1.dot] = -1, [x3] = 1, [x3.dot] = 0, [x2] = 2, [x2.dot] = 0, [u1] = 0, [u2] = 0 },
      exact = { [x1] = e1, [x2] = e2, [x3] = e3, [u1] = torque + w, [u2] = torque },
    }
  end,
}

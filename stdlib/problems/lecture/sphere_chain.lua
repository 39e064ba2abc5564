return {
  title = "Exam problem 1: a mass on a sphere and a second one on a link",
  source = "scripts/exam/problem1.lua",
  statement = [[Six coordinates, two constraints, made by lagrange{ … }. It shows drift and what an
    inconsistent start does.]],
  tags = "exam mechanics nonlinear",
  index = 3, dof = 8, structural_index = 3, structural_dof = 8, verdict = "valid",
  to = 1, dt = 0.01,
  build = function()
    local q = var("q", 6)
    local p1, p2 = q:slice(1, 3), q:slice(4, 6)
    local m, g, R, L = params "m=1 g=9.81 R=1 L=0.5"
    local d = p1 - p2
    return {
      model = lagrange { q = q, T = m/2*q.dot.T*q.dot, V = m*g*(p1[3] + p2[3]),
        C = { (p1.T*p1 - R^2)/2, (norm(p2 - p1)^2 - L^2)/2 }, name = "sphere and link" },
      constraints = { p1.T*p1 - R^2, d.T*d - L^2, p1.T*p1.dot, d.T*d.dot },
      fix = { [p1] = {0.6, 0, -0.8}, [p2] = {0.6, 0, -1.3}, [p1.dot] = {0.8, 0.5, 0.6},
        [p2.dot] = {1.1, 0.3, 0.6} },
      reference = { [q[1]] = -0.144841130698, [q[2]] = 0.1105402845318, [q[3]] = -0.9832608465478,
        [q[4]] = -0.519586681004, [q[5]] = -0.01796830086689, [q[6]] = -1.288303984488,
        [q[1].dot] = -1.351738309635, [q[2].dot] = -0.1968251818234, [q[3].dot] = 0.1769929049698,
        [q[4].dot] = -1.780537820807, [q[5].dot] = -0.642940499127, [q[6].dot] = 0.8917126610303 },
    }
  end,
}

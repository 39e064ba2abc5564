return {
  title = "Andrews' squeezing mechanism",
  source = "Hairer & Wanner, Solving ODEs II, 2nd ed., §VII.7; Mazzia & Magherini, Test Set for IVP Solvers",
  statement = [[Seven bodies, seven angles, six loop constraints, one degree of freedom, a spring and a
    constant driving torque. Here the equations are made by lagrange{ … } from the positions of the centres of
    mass.]],
  tags = "mechanics nonlinear benchmark",
  index = 3, dof = 2, structural_index = 3, structural_dof = 2, verdict = "valid",
  to = 0.03, dt = 0.0001,
  build = function()
    local beta, theta, gamma, phi, delta, omega, epsilon = vars "beta theta gamma phi delta Omega epsilon"
    local q = vec { beta, theta, gamma, phi, delta, omega, epsilon }
    local xa, ya, xb, yb, xc, yc = -0.06934, -0.00227, -0.03635, 0.03273, 0.014, 0.072
    local d, da, e, ea, rr, ra, ss, sa, sb, sc, sd = 0.028, 0.0115, 0.02, 0.01421, 0.007, 0.00092, 0.035,
      0.01874, 0.01043, 0.018, 0.02
    local ta, tb, u, ua, ub, zf, zt, fa = 0.02308, 0.00916, 0.04, 0.01228, 0.00449, 0.02, 0.04, 0.01421
    local a, b, c = vec { xa, ya }, vec { xb, yb }, vec { xc, yc }
    local function along(angle) return vec { cos(angle), sin(angle) } end      -- and a quarter turn back:
    local function across(angle) return vec { sin(angle), -cos(angle) } end
    local bodies = {                    -- mass, inertia, angular velocity, centre of mass
      { 0.04325, 2.194e-6, beta.dot, ra*along(beta) },
      { 0.00365, 4.410e-7, beta.dot + theta.dot, rr*along(beta) - da*along(beta + theta) },
      { 0.02373, 5.255e-6, gamma.dot, b + sa*across(gamma) + sb*along(gamma) },
      { 0.00706, 5.667e-7, phi.dot + delta.dot, a + zt*along(delta) + (e - ea)*across(phi + delta) },
      { 0.07050, 1.169e-5, delta.dot, a + ta*along(delta) - tb*across(delta) },
      { 0.00706, 5.667e-7, omega.dot + epsilon.dot,
        a + u*across(epsilon) + (zf - fa)*along(omega + epsilon) },
      { 0.05498, 1.912e-5, epsilon.dot, a + ua*across(epsilon) - ub*along(epsilon) },
    }
    local T = 0
    for _, body in ipairs(bodies) do
      local v = der(body[4])
      T = T + body[1]/2*v.T*v + body[2]/2*body[3]^2
    end
    local spring = norm(b + sc*across(gamma) + sd*along(gamma) - c)
    local tip = rr*along(beta) - d*along(beta + theta)
    local C = vstack(tip - ss*across(gamma) - b, tip - e*across(phi + delta) - zt*along(delta) - a,
      tip - zf*along(omega + epsilon) - u*across(epsilon) - a)
    local constraints = {}
    for i = 1, 6 do constraints[i], constraints[i + 6] = C[i], der(C[i]) end
    return {
      model = lagrange { q = q, T = T, V = 4530/2*(spring - 0.07785)^2, C = C,
        Q = { 0.033, 0, 0, 0, 0, 0, 0 },
        name = "squeezing mechanism" },
      constraints = constraints,
      fix = { [theta] = 0, [theta.dot] = 0 },
      guess = { [beta] = -0.0617138900142765, [gamma] = 0.45527981916307, [phi] = 0.222668390165886,
        [delta] = 0.487364979543843,
        [omega] = -0.222668390165886, [epsilon] = 1.23054744454982 },
      reference = { [beta] = 15.81077119629904, [theta] = -15.75637105984298, [gamma] = 0.04082224013073101,
        [phi] = -0.5347301163226948, [delta] = 0.5244099658805304, [omega] = 0.5347301163226948,
        [epsilon] = 1.048080741042263 },
    }
  end,
}

return {
  title = "Cart with a pendulum, in minimal coordinates",
  source = "scripts/lecture/cart_pendulum.lua, with one angle (from the horizontal) throughout",
  statement = [[A mass m on rails, a mass M at the end of a rod of length L: an ODE, W(q) q″ = rhs with a full
    matrix W.]],
  tags = "lecture mechanics nonlinear",
  index = 0, dof = 4, structural_index = 0, structural_dof = 4, verdict = "valid",
  to = 2, dt = 0.02,
  build = function()
    local x, theta = vars "x theta"
    local m, M, L, g = params "m=2 M=1 L=0.5 g=9.81"
    return {
      model = lagrange { q = {x, theta}, V = M*g*L*sin(theta), name = "cart-pendulum",
        T = (m + M)/2*x.dot^2 + M*L^2/2*theta.dot^2 - L*M*theta.dot*x.dot*sin(theta) },
      constraints = {},
      fix = { [x] = 0, [theta] = 0.5, [x.dot] = 0, [theta.dot] = 0 },
      reference = { [x] = -0.0156558166224, [theta] = 0.23924374181821, [x.dot] = -0.1229769864363,
        [theta.dot] = -3.1137621646155 },
    }
  end,
}

-- An example of tasks: pendula grade scripts/grading/tasks.lua scripts/grading/submissions
title "Exercise 3: the pendulum, methods, identification"

local theta, x, y, u, v, z = vars "theta x y u v z"
local m, g, l = param "m", param "g", param "l"

task { "energy", points = 2, text = "Total energy of the pendulum, V = 0 at the pivot",
  answer = m*l^2*theta.dot^2/2 - m*g*l*cos(theta),
  wrong = "The kinetic energy is m l² θ′²/2, the potential energy -m g l cos θ.",
  mistakes = {
    { answer = m*l^2*theta.dot^2/2 + m*g*l*cos(theta), points = 1,
      feedback = "The sign of the potential energy." },
    { answer = m*l*theta.dot^2/2 - m*g*l*cos(theta), feedback = "The moment of inertia is m l²." } } }

task { "pendulum", points = 3, text = "The pendulum in Cartesian coordinates, index 3",
  answer = dae { der(x) ~ u, der(y) ~ v, m*der(u) ~ -z*x, m*der(v) ~ -z*y - m*g, 0 ~ x^2 + y^2 - l^2 } }

task { "index", answer = 3 }

task { "period", points = 2, text = "Period for small angles, l = 1, g = 9.81, in seconds",
  answer = 2*math.pi/math.sqrt(9.81), tolerance = 1e-3 }

task { "method", points = 2, text = "Heun's method as a tableau", answer = rk.heun }

task { "higher", points = 2, text = "A method of order 3 or more with at most four stages",
  check = function(tab)
    local order = tab:order()
    if order < 3 then return 0, ("the method has order %d"):format(order) end
    return tab.stages <= 4 and 1 or 0.5, ("order %d, %d stages"):format(order, tab.stages)
  end }

task { "poles", points = 1, text = "Poles of 1/(s² + 3 s + 2)", answer = { -1, -2 }, any_order = true }

local function response(count, seed)
  local list = { y = {}, u = {} }
  for k = 1, count do
    seed = seed*48271 % 2147483647
    list.u[k] = seed % 2 == 0 and 1 or -1
    list.y[k] = 0.7*(list.y[k - 1] or 0) + 0.5*(list.u[k - 1] or 0) + 0.02*math.sin(77*k)
  end
  return iddata { y = list.y, u = list.u, Ts = 1 }
end
task { "plant", points = 2, text = "An ARX model of the data", fit = response(200, 11), least = 90 }

-- Reactions, and other small stiff systems.
local list = {}
local function add(problem) list[#list + 1] = problem end

add {
  name = "E5, t = 1e9", to = 1e9, start = { y1 = 1.76e-3, y2 = 0, y3 = 0, y4 = 0 },
  source = "Mazzia & Magherini, Test Set for IVP Solvers; there to 10¹³",
  model = function()
    local y1, y2, y3, y4 = vars "y1 y2 y3 y4"
    local A, B, C, M = 7.89e-10, 1.1e7, 1.13e3, 1e6
    return dae { der(y1) ~ -A*y1 - B*y1*y3, der(y2) ~ A*y1 - M*C*y2*y3,
      der(y3) ~ A*y1 - B*y1*y3 - M*C*y2*y3 + C*y4, der(y4) ~ B*y1*y3 - C*y4 }
  end,
  atol = function(rtol) return rtol*1e-20 end,
  stiff = true, count = { "y1", "y2", "y3" },
}

add {
  name = "Oregonator", to = 360, start = { y1 = 1, y2 = 2, y3 = 3 },
  source = "Hairer & Wanner, Solving ODEs II, 2nd ed., §IV.10",
  model = function()
    local y1, y2, y3 = vars "y1 y2 y3"
    return dae { der(y1) ~ 77.27*(y2 + y1*(1 - 8.375e-6*y1 - y2)), der(y2) ~ (y3 - (1 + y1)*y2)/77.27,
      der(y3) ~ 0.161*(y1 - y3) }
  end,
  stiff = true, count = { "y1", "y2", "y3" },
}

add {
  name = "Van der Pol, 1e6", to = 2, start = { y = 2, z = -0.66 },
  source = "Hairer & Wanner, Solving ODEs II, 2nd ed., §IV.10",
  model = function()
    local y, z = vars "y z"
    return dae { der(y) ~ z, der(z) ~ 1e6*((1 - y^2)*z - y) }
  end,
  stiff = true, count = { "y", "z" },
}

add {
  name = "Van der Pol, 30", to = 200, start = { y = 2, z = 0 },
  source = "van der Pol, Phil. Mag. 2, 1926: slow parts are stiff, jumps are not",
  model = function()
    local y, z = vars "y z"
    return dae { der(y) ~ z, der(z) ~ 30*(1 - y^2)*z - y }
  end,
  stiff = true, count = { "y", "z" },
}

add {
  name = "pollution", to = 60,
  source = "Verwer, SIAM J. Sci. Comput. 15, 1994; Mazzia & Magherini, Test Set for IVP Solvers",
  model = function(problem)
    local y = var("y", 20)
    local k = { .35, .266e2, .123e5, .86e-3, .82e-3, .15e5, .13e-3, .24e5, .165e5, .9e4, .22e-1, .12e5,
      .188e1, .163e5, .48e7, .35e-3, .175e-1, .1e9, .444e12, .124e4, .21e1, .578e1, .474e-1, .178e4, .312e1 }
    -- the species that react; of the reactions 1 … 25
    local of = { { 1 }, { 2, 4 }, { 5, 2 }, { 7 }, { 7 }, { 7, 6 }, { 9 }, { 9, 6 }, { 11, 2 }, { 11, 1 },
      { 13 }, { 10, 2 }, { 14 }, { 1, 6 }, { 3 }, { 4 }, { 4 }, { 16 }, { 16 }, { 17, 6 }, { 19 }, { 19 },
      { 1, 4 }, { 19, 1 }, { 20 } }
    local r = {}
    for i, species in ipairs(of) do
      r[i] = k[i]*y[species[1]]
      if species[2] then r[i] = r[i]*y[species[2]] end
    end
    local rate = { -r[1] - r[10] - r[14] - r[23] - r[24] + r[2] + r[3] + r[9] + r[11] + r[12] + r[22] + r[25],
      -r[2] - r[3] - r[9] - r[12] + r[1] + r[21], -r[15] + r[1] + r[17] + r[19] + r[22],
      -r[2] - r[16] - r[17] - r[23] + r[15], -r[3] + 2*r[4] + r[6] + r[7] + r[13] + r[20],
      -r[6] - r[8] - r[14] - r[20] + r[3] + 2*r[18], -r[4] - r[5] - r[6] + r[13], r[4] + r[5] + r[6] + r[7],
      -r[7] - r[8], -r[12] + r[7] + r[9], -r[9] - r[10] + r[8] + r[11], r[9], -r[11] + r[10], -r[13] + r[12],
      r[14], -r[18] - r[19] + r[16], -r[20], r[20], -r[21] - r[22] - r[24] + r[23] + r[25], -r[25] + r[24] }
    local start, equations = {}, {}
    for i = 1, 20 do start[i], equations[i] = 0, der(y[i]) ~ rate[i] end
    start[2], start[4], start[7], start[8], start[9], start[17] = 0.2, 0.04, 0.1, 0.3, 0.01, 0.007
    problem.start = { [y] = start }
    return dae(equations)
  end,
  atol = function(rtol) return rtol*1e-8 end,
  stiff = true, count = { "y1", "y2", "y5", "y10", "y20" },
}

add {
  name = "a brake that is released", to = 200, start = { x = 1, y = 0 },
  source = "x″ = -x - c(t) x′ with c = 10⁵ until t = 1 and nearly nothing after it: stiff, then not",
  model = function()
    local x, y = vars "x y"
    return dae { der(x) ~ y, der(y) ~ -x - 5e4*(1 - tanh(15*(t - 1)))*y + sin(t/3) }
  end,
  stiff = true, count = { "x", "y" },
}

return list

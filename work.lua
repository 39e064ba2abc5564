-- A model of Pendula.
local x = var("x")
local v = var("v")
local k = param("k", 4)
local value1 = dae {
  der(x) ~ v,
  der(v) ~ -(x*k),
}
-- A model of Pendula.
local x = var("x")
local v = var("v")
local k = param("k", 4)
local value2 = dae {
  der(x) ~ v,
  der(v) ~ -(x*k),
}
return { ["at"] = value1:init { fix = { [var("x")] = 0.40808206170734773, [var("v")] = -1.8258905007146675 }, from = 10.0 }, ["model"] = value2, ["note"] = "at t = 10" }

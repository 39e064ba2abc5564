-- The tableaus that come with the program: one file each, listed here in the order of help(). A file returns the
-- table of coefficients; the tableau is built, and its claims proved, when rk.name is first touched.
local names = {
  "euler", "midpoint", "heun", "ralston", "kutta3", "heun3", "ralston3", "ssprk33", "bogacki_shampine", "rk4",
  "kutta38", "fehlberg45", "cash_karp", "dopri5", "tsit5", "butcher6", "verner65", "verner76", "verner87", "dop853",
  "verner98",
  "implicit_euler", "implicit_midpoint", "trapezoid", "sdirk2", "crouzeix", "crouzeix4", "qin_zhang", "sdirk3",
  "sdirk4", "tr_bdf2", "esdirk32", "esdirk43",
}

-- Lists of weights may leave out zeros at their end.
local function pad(list, size)
  for i = #list + 1, size do list[i] = 0 end
end

local function load_rosenbrock(name)
  local data = include("tableaus/rosenbrock/" .. name)
  for i, row in ipairs(data.dense or {}) do pad(row, #data.m) end
  return rosenbrock(data)
end

local function load_tableau(name)
  local data = include("tableaus/" .. name)
  for _, key in ipairs { "b", "bhat", "bhat2" } do
    if data[key] then pad(data[key], #data.A) end
  end
  return tableau(data)
end

local function register(library, folder, title, name, load)
  doc {
    name = library .. "." .. name, sig = library .. "." .. name, module = library, title = title,
    text = "", example = library .. "." .. name .. ":order()",
    describe = function(entry)
      local data = include(folder .. name)
      entry.text = data.text .. " (" .. data.cite .. ")"
      entry.gives = tostring(data.order)
    end,
    load = function() return load(name) end,
  }
end

for _, name in ipairs(names) do register("rk", "tableaus/", "Butcher tableaus", name, load_tableau) end
for _, name in ipairs { "ros2", "ros3p", "rodas3", "rodas4", "rodas4p", "rodas5p" } do
  register("rosenbrock", "tableaus/rosenbrock/", "Rosenbrock methods", name, load_rosenbrock)
end

return names

-- The tableaus that come with the program: one file each, listed here in the order of help().
local names = {
  "euler", "midpoint", "heun", "rk4", "kutta38", "bogacki_shampine", "dopri5",
  "implicit_euler", "implicit_midpoint", "trapezoid",
}

for _, name in ipairs(names) do
  local tab = include("tableaus/" .. name)
  doc {
    name = "rk." .. name, sig = "rk." .. name, module = "rk", title = "Butcher tableaus",
    text = tab.text .. " (" .. tab.cite .. ")",
    example = "rk." .. name .. ":order()", gives = tostring(tab:order()),
    tab,
  }
end

return names

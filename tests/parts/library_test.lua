-- Every part of every library has a text and a source, its equations balance, and its example gives what it
-- says.
local domains = { "electrical", "translational", "rotational", "planar", "spatial", "thermal", "hydraulic",
  "process", "signals" }

for _, domain in ipairs(domains) do
  for name, part in components[domain]() do
    if getmetatable(part) == "component" then
      local title = domain .. "." .. name
      test(title .. " says what it is", function()
        expect(#part.text > 5):is_true()
        expect(#part.source > 3):is_true()
        expect(tostring(part):find("source:", 1, true) ~= nil):is_true()
      end)
      test(title .. " prints its defaults", function()
        expect(tostring(part):find("{…}", 1, true)):equals(nil)
      end)
      test(title .. " has the analytic solution of its example", function()
        expect(part.example ~= ""):is_true()
        local made = {}
        local function noted(items)
          made[#made + 1] = model(items)
          return made[#made]
        end
        local surroundings = setmetatable({ e = components[domain], model = noted }, { __index = _G })
        local value = load(part.example, title, "t", surroundings)()
        if type(value) == "number" then
          expect(value):near(tonumber(part.gives), 1e-6)
        else
          expect(tostring(value)):equals(part.gives)
        end
        for _, m in ipairs(made) do expect(table.concat(m:flat():units(), "\n")):equals "" end
      end)
    end
  end
end

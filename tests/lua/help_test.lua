-- Pages about concepts: found by name, by a word, by a question; their names to go on with exist.

local function shown(script)
  local file = os.tmpname()
  local program = os.getenv "PENDULA" or "pendula"
  local out = assert(io.open(file, "w"))
  out:write(script)
  out:close()
  local run = assert(io.popen(("'%s' '%s' 2>&1"):format(program, file)))
  local text = run:read "a"
  run:close()
  os.remove(file)
  return text
end

test("words lead to pages", function()
  local text = shown [[
    for _, word in ipairs { "stiff", "tolerance", "rtol", "events", "ans", "solver", "derivative", "keys",
      "drift", "identifiability", "index", "ode45", "bounce", "initial conditions", "how to choose a method",
      "transpose" } do
      print("=== " .. word)
      help(word)
    end]]
  for word, expected in pairs { stiff = "stability, not accuracy", tolerance = "rtol is relative",
    rtol = "atol is the size",
    events = "located to rounding", ans = "first value of the last line", solver = "Runge-Kutta",
    derivative = "chain rule", keys = "Ctrl-R", drift = "project", identifiability = "the data change",
    index = "derivatives of all unknowns", bounce = "reset sets", ["initial conditions"] = "consistent start",
    ["how to choose a method"] = "methods", transpose = "A.T" } do
    local page = text:match("=== " .. word .. "\n(.-)\n===") or text:match("=== " .. word .. "\n(.*)$")
    if not page or not page:gsub("%s+", " "):find(expected, 1, true) then
      error(("help %q does not say %q but %s"):format(word, expected, tostring(page)), 0)
    end
  end
  expect(text:find("attempt to", 1, true)):equals(nil)
end)

test("every page leads on to names that exist", function()
  local text = shown [[
    local see = {}
    for _, file in ipairs { "models", "integration", "data", "tasks" } do
      local text = io.open("stdlib/concepts/" .. file .. ".lua"):read "a"
      for names in text:gmatch 'see = "(.-)"' do see[#see + 1] = names end
    end
    for _, names in ipairs(see) do
      for name in names:gmatch "%S+" do
        if not pcall(help, name) then print("MISSING " .. name) end
      end
    end
    print("pages " .. #see)]]
  expect(text:match "MISSING [^\n]*"):equals(nil)
  expect(tonumber(text:match "pages (%d+)") >= 40):equals(true)
end)

test("apropos puts whole words first", function()
  local text = shown 'apropos "table"'
  local first = text:match "^%s*([^\n]*)"
  expect(first:lower():find "%f[%w]table%f[%W]" ~= nil):equals(true)
end)

local function count(text, plain)
  local n, at = 0, 1
  while true do
    local first, last = text:find(plain, at, true)
    if not first then return n end
    n, at = n + 1, last + 1
  end
end

test("the page of a type that is a module, too, has every member once", function()
  local text = shown 'help "lti"'
  expect(count(text, "G:poles() ->")):equals(1)
  expect(count(text, "G.A ->")):equals(1)
  expect(count(text, "series(G1, G2, …) -> G")):equals(1)
end)

test("examples show the name in use, not what a test asks", function()
  local text = shown 'examples "plot"'
  expect(count(text, ":match") + count(text, "expect(") + count(text, "os.tmpname")):equals(0)
  expect(count(shown 'examples "expect"', "expect(") > 2):equals(true)
end)

test("the overview lists what users type", function()
  local text = shown "help()"
  for _, name in ipairs { "solution_of_parts", "shards", "label_text", "random_at", "parallel_calls" } do
    expect(count(text, name)):equals(0)
  end
  expect(text):matches "\nIntegration +converge\n"
end)

test("signs have pages", function()
  for sign, words in pairs { ["~"] = "An equation.", ["=="] = "The same structure", ["<"] = "names lt and gt",
    ["^"] = "Power;", ["%"] = "names the remedy" } do
    expect(shown(('help "%s"'):format(sign)):find(words, 1, true) ~= nil):is_true()
  end
end)

test("parts are found by their names", function()
  local text = shown 'help "clutch" help "rotational.spring" help(components) apropos "winding"'
  for _, expected in ipairs { "components.rotational.clutch: A friction clutch",
    "components.rotational.spring: ", "components.hydraulic ", "components.electrical " } do
    expect(text:find(expected, 1, true) ~= nil):is_true()
  end
  expect(text:find("components.translational.spring", 1, true)):equals(nil)
  local springs = shown 'help "spring"'
  for _, expected in ipairs { "networks and mechanisms", "components.rotational.spring ",
    "components.planar.spring " } do expect(springs:find(expected, 1, true) ~= nil):is_true() end
  expect(shown 'help "no_such_part"':find("there is nothing called", 1, true) ~= nil):is_true()
end)

-- Results as JSON.

local x, v = vars "x v"
local k = param("k", 4)

test("plain values", function()
  expect(json(1/3)):equals "0.33333333333333331"
  expect(json(3)):equals "3"
  expect(json(0/0)):equals "null"
  expect(json 'a "b"\n\\\1'):equals [["a \"b\"\n\\\u0001"]]
  expect(json { true, { x = 1 } }):equals '[true, {"x": 1}]'
  expect(json {}):equals "[]"
  expect(json(rational "1/4")):equals "0.25"
  expect(json(x^2)):equals '"x²"'
  expect(json(vec(1, 2))):equals "[1, 2]"
  expect(function() json(print) end):fails "json: a function has no text"
  local ring = {}
  ring[1] = ring
  expect(function() json(ring) end):fails "nested more than 40 deep"
end)

test("solutions, starts, models and other results", function()
  local osc = dae { der(x) ~ v, der(v) ~ -k*x, name = "spring" }
  local sol = osc:integrate { start = { x = 1, v = 0 }, to = 1, times = { 0, 0.5, 1 } }
  local text = json(sol)
  expect(text:find('"status": "finished", "t": [0, 0.5, 1], "values": {"x": [1, ', 1,
    true) ~= nil):equals(true)
  expect(json(osc):find('"equations": ["x′ = v", ', 1, true) ~= nil):equals(true)
  expect(json(osc:init { fix = { x = 1, v = 2 } }):find('"values": {"x": 1, "v": 2}', 1,
    true) ~= nil):equals(true)
  expect(json(sol:stats()):find('"steps": ', 1, true) ~= nil):equals(true)
  expect(json(tf({ 1 }, { 1, 2 })):find('"type": "lti"', 1, true) ~= nil):equals(true)
  local file = os.tmpname()
  json({ 1 }, file)
  expect(io.open(file):read "a"):equals "[1]\n"
  os.remove(file)
end)

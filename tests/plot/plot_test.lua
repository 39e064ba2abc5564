-- Figures from Lua: argument forms, options, labels, errors in the user's words, files.
local x, y, z = {}, {}, {}
for i = 1, 100 do x[i], y[i], z[i] = i / 10, math.sin(i / 10), math.cos(i / 10) end

test("every argument form makes a figure", function()
  expect(tostring(plot(y))):equals "figure: 1 series, 100 points"
  expect(tostring(plot(x, y))):equals "figure: 1 series, 100 points"
  expect(tostring(plot(x, y, x, z))):equals "figure: 2 series, 200 points"
  expect(tostring(plot(x, { y, z }))):equals "figure: 2 series, 200 points"
  expect(tostring(plot({ y, z }))):equals "figure: 2 series, 200 points"
  expect(tostring(plot({ 1, 2, 3 }, { { 1, 2 }, { 3, 4 }, { 5, 6 } }))):equals "figure: 2 series, 6 points"
  expect(tostring(plot(1, 2, { style = "points" }))):equals "figure: 1 series, 1 point"
  expect(tostring(plot3(x, y, z))):equals "3-D figure: 1 series, 100 points"
  expect(tostring(plot3({ { 1, 2, 3 }, { 4, 5, 6 } }))):equals "3-D figure: 1 series, 2 points"
  expect(tostring(plot3 { surfaces = { sphere(1) } })):equals "3-D figure: 1 surface"
  expect(tostring(semilogx(x, y))):equals "figure: 1 series, 100 points"
  local figure = plot(x, y)
  expect(plot(figure)):equals(figure)
end)

test("labels name the curves in their order", function()
  local f = plot(x, { y, z }, { labels = { "sine", "cosine" }, title = "Waves" })
  expect(f.labels):equals { "sine", "cosine" }
  expect(f.title):equals "Waves"
  expect(f:text()):matches "sine.*cosine"
  expect(plot(x, y, { labels = "sine" }).labels):equals { "sine" }
  expect(function() plot(x, y,
    { labels = { "a", "b" } }) end):fails "plot: option 'labels' has 2 labels for 1 curve"
end)

test("what cannot be drawn is counted or refused", function()
  expect(semilogy({ 1, 0.1, 0 }).notes):equals
    { "1 of 3 points of the data is not positive: no place on the logarithmic y axis" }
  expect(plot({ 1, 0 / 0, 3 }).notes):equals { "1 of 3 points of the data is not finite (drawn as gaps)" }
  expect(function() plot(x, { 1, 2 }) end):fails "plot: x has 100 values but y has 2"
  expect(function() plot(x, {}) end):fails "plot: x has 100 values but y has 0"
  expect(function() plot() end):fails "plot: nothing to draw: write plot(x, y)"
  expect(function() plot(x, nil) end):fails "plot: argument 2 is nil"
  expect(function() plot(x, y, x) end):fails "plot: arguments come in pairs x, y, but there are 3"
  expect(function() plot(tf({ 1 }, { 1, 1 })) end):fails("not a linear system: its step response is "
    .. "plot(G:step()), its frequency response plot(G:bode())")
  expect(function() plot "x" end):fails "plot: y must be a list of numbers or a column, not a string"
  expect(function() plot { 1, nil, 3 } end):fails "entry 2 of y is nil"
  expect(function() plot { 1, "two" } end):fails "entry 2 of y"
  expect(function() semilogy { 0, -1 } end):fails "semilogy: nothing to draw: the y axis is logarithmic"
  expect(function() plot(x, y,
    { titel = "a" }) end):fails "plot: unknown option 'titel'. Did you mean 'title'?"
  expect(function() plot(x, y, { style = "lines" }) end):fails "unknown style 'lines'. Did you mean 'line'?"
  expect(function() plot(x, y,
    { xlim = { 2, 1 } }) end):fails "xlim = {2, 1}: the first limit must be below the second"
  expect(function() plot(x, y, { xlim = 3 }) end):fails "option 'xlim': expected a list, got a number"
  expect(function() plot(x, y,
    { title = 3 }) end):fails "option 'title' must be a string or an expression, not a number"
  expect(function() plot3(x, y) end):fails "plot3: expected x, y, z or sol, p, but there are 2 arguments"
  expect(function() plot3 { surfaces = { 3 } } end):fails "surfaces[1] must be a surface"
  expect(function() plot3(x, y, z, { view = { 100, 0 } }) end):fails "the tilt must lie between 0"
end)

test("surfaces", function()
  expect(tostring(sphere(2, { 1, 0, 0 }))):equals "surface: 25×49 nodes"
  expect(tostring(surface(function(a, b) return a * b end, { 0, 1 }, { 0, 2 },
    4))):equals "surface: 5×5 nodes"
  expect(tostring(surface(function(a, b) return a, b, a * b end, { 0, 1 }, { 0, 2 },
    4))):equals "surface: 5×5 nodes"
  expect(function() sphere(-1) end):fails "sphere: the radius must be a positive number, got -1"
  expect(function() sphere(1, { 1, 2 }) end):fails "sphere: the center must have three coordinates, got 2"
  expect(function() surface(function() return "a" end, { 0, 1 }, { 0, 1 }) end):fails "surface: "
  expect(function() surface(function() error "my own error" end, { 0, 1 }, { 0, 1 }) end):fails "my own error"
  expect(function() surface(function() return 0 / 0 end, { 0, 1 },
    { 0, 1 }) end):fails "surface: nothing to draw"
  expect(function() surface(function() return 1, 2 end, { 0, 1 }, { 0, 1 }) end):fails "it returned 2 values"
end)

test("spy draws a cell for every entry that is not zero", function()
  local f = spy { { 1, 0, 2 }, { 0, 3, 0 } }
  expect(f.notes):equals { "3 of 6 entries are not zero" }
  expect(f:text()):matches "⣿"
  expect(function() spy { { 0, 0 } } end):fails "spy: all 2 entries are zero"
  expect(function() spy(3) end):fails "spy: expected a matrix, got number"
  expect(function() spy { { 1 }, { 1, 2 } } end):fails "spy: expected a matrix or a list of equally long rows"
end)

test("the terminal drawing is the same every time and as wide as asked", function()
  local f = plot(x, { y, z }, { labels = { "sine", "cosine" }, xlabel = "t [s]", ylabel = "value" })
  expect(f:text()):equals(f:text())
  for _, columns in ipairs { 30, 80, 120 } do
    for line in f:text(columns):gmatch "[^\n]+" do expect(utf8.len(line) <= columns):is_true() end
  end
  expect(function() f:text(10) end):fails "columns must lie between 30 and 120, got 10"
end)

test("saving says what is wrong and returns the figure", function()
  local f = plot(x, y)
  expect(function() f:save "a.jpg" end):fails "unknown extension '.jpg'; the extension says the format: .svg, .png or .pdf"
  expect(function() f:save "/nowhere/at/all/a.svg" end)
    :fails "there is no folder '/nowhere/at/all/'; make it first"
  expect(function() f:save() end):fails "bad argument #1 'file': expected a string"
  local name = os.tmpname()
  expect(f:save(name .. ".svg")):equals(f)
  local file = io.open(name .. ".svg")
  expect(file:read "l"):matches "xml"
  file:close()
  os.remove(name .. ".svg")
  os.remove(name)
end)

test("lines across, their labels and texts are drawn", function()
  local f = plot({ 0, 1, 2 }, { 0, 1, 4 }, { hlines = { { 2, "limit" } }, vlines = 1, texts = { { 0.5, 3,
    "here" } } })
  expect(f:text(60)):matches "limit"
  expect(f:text(60)):matches "here"
  expect(function() plot({ 0, 1 }, { texts = { { 1,
    2 } } }) end):fails "texts[1] must be { x, y, \"words\" }"
end)

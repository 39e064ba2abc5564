-- Labels of any text reach the picture: quotes of every kind, what gnuplot would replace, what SVG would.
local texts = { "f''(x)", "'x'", "'", "''", "a'b''c", "it's", "`ls`", "$(ls)", "\\n", "{/b x}", "x_1^2", "%d",
  '"q"', "<a> & b",
  "@x", "#1" }
test("titles, axes, curves and notes may contain anything", function()
  local file = os.tmpname() .. ".svg"
  for _, text in ipairs(texts) do
    plot({ 1, 2, 3 }, { title = text, xlabel = text, ylabel = text, labels = { text }, legend = true,
      notes = { text } }):save(file)
    local picture = io.open(file):read "a":gsub("&#39;", "'"):gsub("&apos;", "'")
    if not text:find '[<>&"]' and not picture:find(text, 1, true) then error("missing: " .. text, 0) end
    plot3({ 1, 2 }, { 1, 2 }, { 1, 2 }, { title = text, xlabel = text, ylabel = text,
      zlabel = text }):save(file)
  end
  os.remove(file)
  expect(#texts):equals(16)
end)

-- Documents: reports, notebooks, the manual. What is behind them, stdlib/document, is read when it is first
-- touched: document.mathml, document.page, …
document = setmetatable({}, { __index = function(parts, name)
  if name == "recorder" then return nil end          -- set while one records
  local part = include("document/" .. name)
  rawset(parts, name, part)
  return part
end })

doc { name = "view", module = "plot",
  sig = "view(x [, { file =, open = true, slider =, values = }]) -> file name",
  text = [[A page of one value in the browser: its mathematics, tables and figures as in a report; of a list
    of values all of them, or of a list of figures one at a time with slider = "k", values = { 1, 2 }. Without
    a screen, or with open = false, it only writes the page. In a report the value is shown where the call
    stands, unless a file is named.]],
  example = [[
    x = var "x"
    page = view(x^2/3, { file = os.tmpname() .. ".html", open = false })
    return io.open(page):read "a":match "<mfrac>.-</mfrac>"]],
  gives = "<mfrac><msup><mi>x</mi><mn>2</mn></msup><mn>3</mn></mfrac>",
  options = { option("file", "string", "the name of the page; without it a temporary file"),
    option("open", "boolean", "whether the browser shows it", "true"),
    option("slider", "string", "of a list of figures: the name of the quantity that changes"),
    option("values", "list", "its values, one for each figure") }, options_at = 2,
  function(x, options) return document.view(x, options) end }

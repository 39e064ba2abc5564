-- view(x): a page of one value, in the browser.
local recording, page = document.recording, document.page

local function target_of(options)
  if options.file == nil then return os.tmpname() .. ".html" end
  if type(options.file) ~= "string" or not options.file:find "%.html?$" then
    fail 'view: file must be the name of a page, as in view(x, { file = "x.html" })'
  end
  return options.file
end

return function(x, options)
  options = options or {}
  if type(options) ~= "table" then fail 'view: options are a table, as in view(x, { file = "x.html" })' end
  for key in pairs(options) do
    if key ~= "file" and key ~= "open" then
      fail(("view: unknown option '%s'.%s"):format(tostring(key),
        did_you_mean(tostring(key), { "file", "open" })))
    end
  end
  if x == nil then fail "view: there is nothing to show: the value is nil" end
  if document.recorder and not options.file then return document.recorder:show(x) end
  local record = recording.new()
  record:show(x)
  local title = (shown(x):match "^[^\n]*"):sub(1, 80)
  local target = target_of(options)
  write_file(target, page.html(title, '<section class="output">' .. record:html(0, record:drawings())
    .. "</section>"), "view")
  if options.open ~= false then page.open(target) end
  return target
end

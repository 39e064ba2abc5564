-- view(x): a page of one value, in the browser.
local recording, page = document.recording, document.page

local function check_arguments(x, options)
  if options.file ~= nil and (type(options.file) ~= "string" or not options.file:find "%.html?$") then
    fail 'view: file must be the name of a page, as in view(x, { file = "x.html" })'
  end
  if x == nil then fail "view: there is nothing to show: the value is nil" end
end

-- The figures of a sequence and the values of their slider.
local function check_frames(x, options)
  local usage = ', as in view({ fig1, fig2 }, { slider = "k", values = { 1, 2 } })'
  if type(x) ~= "table" or object_type(x) or #x == 0 then
    fail("view: a slider needs a list of figures" .. usage)
  end
  for i, each in ipairs(x) do
    if object_type(each) ~= "figure" then
      fail(("view: entry %d of the list is not a figure but %s"):format(i, object_type(each) or type(each)))
    end
  end
  if type(options.slider) ~= "string" then
    fail("view: slider is the name of the quantity that changes" .. usage)
  end
  local values = options.values or {}
  if type(values) ~= "table" or options.values and #values ~= #x then
    fail(("view: %d figures need as many values%s"):format(#x, usage))
  end
  if not options.values then
    for i = 1, #x do values[i] = i end
  end
  return values
end

return function(x, options)
  check_arguments(x, options)
  local record = document.recorder
  local inside = record and not options.file
  if not inside then record = recording.new() end
  if options.slider ~= nil then
    record:show_frames(x, options.slider, check_frames(x, options))
  else
    record:show(x)
  end
  if inside then return end
  local title = (shown(x):match "^[^\n]*"):sub(1, 80)
  local target = options.file
  if not target then
    local name = os.tmpname()                        -- exists, so the name with an ending is ours as well
    target = name .. ".html"
    os.remove(name)
  end
  write_file(target, page.html(title, '<section class="output">' .. record:html(0, record:drawings())
    .. "</section>"), "view")
  if options.open ~= false then page.open(target) end
  return target
end

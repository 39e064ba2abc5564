-- Text in HTML. Whatever a script prints may end here: markup is escaped, bytes that are no UTF-8 and
-- control characters become U+FFFD, and nothing else changes.
local M = {}

local replacement = "\u{FFFD}"

-- Valid UTF-8 without control characters; line ends, of whatever system, and tabs stay.
function M.valid(text)
  text = text:gsub("\r\n?", "\n")
  local length, bad = utf8.len(text)
  if not length then
    local parts, from = {}, 1
    while not length do
      parts[#parts + 1] = text:sub(from, bad - 1) .. replacement
      from = bad + 1
      length, bad = utf8.len(text, from)
    end
    text = table.concat(parts) .. text:sub(from)
  end
  return (text:gsub("[\0-\8\11-\31\127]", replacement))
end

local marks = { ["&"] = "&amp;", ["<"] = "&lt;", [">"] = "&gt;", ['"'] = "&quot;", ["'"] = "&#39;" }

function M.escaped(text) return (M.valid(text):gsub("[&<>\"']", marks)) end

-- The attribute href of a link that somebody wrote: pages and places on the web, nothing that runs.
function M.safe_link(target)
  local scheme = target:match "^%s*([%a][%w+.-]*):"
  if scheme and not ({ http = true, https = true, mailto = true })[scheme:lower()] then return "#" end
  return M.escaped(target)
end

return M

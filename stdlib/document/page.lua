-- One self-contained page: style, mathematics font and script inside, nothing is fetched.
local text = document.text
local M = {}

local font

-- The style sheet, with the font where there is mathematics.
local function style(body)
  local css = embedded "document/page.css"
  if not body:find("<math", 1, true) then return css end
  font = font or base64(embedded "document/math.woff2")
  return '@font-face{font-family:"Latin Modern Math Subset";src:url(data:font/woff2;base64,' .. font
    .. ') format("woff2")}\n' .. css
end

local template = [[
<!DOCTYPE html>
<html lang="en">
<head>
<meta charset="utf-8">
<meta name="viewport" content="width=device-width, initial-scale=1">
<meta name="color-scheme" content="light dark">
<meta name="generator" content="Pendula">
<meta http-equiv="Content-Security-Policy" content="default-src 'none'; style-src 'unsafe-inline';
 script-src 'unsafe-inline'; font-src data:; img-src data:">
<title>{title}</title>
<style>{style}</style>
</head>
<body>
<main>
{body}
</main>
<script>{script}</script>
</body>
</html>
]]

function M.html(title, body)
  local parts = { title = text.escaped(title), body = body, style = style(body),
    script = embedded "document/page.js" }
  return (template:gsub("{(%l+)}", parts))
end

-- ── programs ───────────────────────────────────────────────────────────────────────────────────────────────

-- A variable of the environment; an empty one counts as none.
function M.environment(name)
  local value = os.getenv(name)
  return value ~= "" and value or nil
end

local function quoted(word) return "'" .. word:gsub("'", "'\\''") .. "'" end
M.quoted = quoted

local function has_program(name)
  return os.execute("command -v " .. quoted(name) .. " >/dev/null 2>&1") == true
end

local browsers = { "chromium", "chromium-browser", "google-chrome" }

-- Prints a page to a PDF file.
function M.print_pdf(html, target, by)
  local browser
  for _, name in ipairs(browsers) do browser = browser or (has_program(name) and name) end
  if not browser then
    fail(by .. ": a PDF file needs the browser chromium, which is not installed: apt-get install chromium "
      .. "(a page, -o report.html, needs nothing)")
  end
  local name = os.tmpname()                          -- exists and is ours: so is what is called after it
  local folder = name .. ".d"
  local page, draft = folder .. "/page.html", folder .. "/page.pdf"
  os.execute("mkdir -m 700 " .. quoted(folder))
  write_file(page, html, by)
  os.execute(("%s --headless --no-sandbox --disable-gpu --user-data-dir=%s --no-pdf-header-footer "
    .. "--print-to-pdf=%s %s >/dev/null 2>&1"):format(quoted(browser), quoted(folder .. "/profile"),
      quoted(draft),
      quoted("file://" .. page)))
  local file = io.open(draft, "rb")
  local bytes = file and file:read "a"
  if file then file:close() end
  os.execute("rm -rf " .. quoted(folder))
  os.remove(name)
  if not bytes or bytes == "" then fail(by .. ": " .. browser .. " wrote no PDF file") end
  write_file(target, bytes, by)
end

-- Shows a page in the user's browser, if there is a screen. True if one was started.
function M.open(path)
  local browser = M.environment "BROWSER"
  if not (M.environment "DISPLAY" or M.environment "WAYLAND_DISPLAY" or browser) then return false end
  local opener = browser or "xdg-open"
  if not has_program(opener) then return false end
  return os.execute(quoted(opener) .. " " .. quoted(path) .. " >/dev/null 2>&1 &") == true
end

return M

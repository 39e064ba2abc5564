-- pendula kernel: makes the kernel known to Jupyter.
local page = document.page

local usage = [[
usage: pendula kernel install [--prefix FOLDER]
       pendula kernel uninstall [--prefix FOLDER]

Writes the description by which Jupyter finds the kernel: for this user, or below FOLDER/share/jupyter.
]]

local template = [[
{
  "argv": [%s, "-f", "{connection_file}"],
  "display_name": "Pendula",
  "language": "lua",
  "interrupt_mode": "signal",
  "metadata": { "debugger": false }
}
]]

local function json_string(words) return '"' .. words:gsub('[\\"]', "\\%0") .. '"' end

local function data_folder(prefix)
  if prefix then return prefix .. "/share/jupyter" end
  local home = page.environment "HOME" or "/root"
  return page.environment "JUPYTER_DATA_DIR"
    or (page.environment "XDG_DATA_HOME" or home .. "/.local/share") .. "/jupyter"
end

-- The second program stands beside this one.
local function kernel_program()
  local path = program_path:match "^(.*/)" .. "pendula-kernel"
  local file = io.open(path, "rb")
  if not file then
    fail("kernel: " .. path
      .. " does not exist: this Pendula was built without xeus. apt-get install xeus-dev "
      .. "nlohmann-json3-dev cppzmq-dev libzmq3-dev, then build it again")
  end
  file:close()
  return path
end

local function install_kernel(folder)
  local program = kernel_program()
  os.execute("mkdir -p " .. page.quoted(folder))
  write_file(folder .. "/kernel.json", template:format(json_string(program)), "kernel")
  print("Jupyter finds the kernel in " .. folder)
end

return function(words)
  local action, prefix, at = nil, nil, 1
  while words[at] do
    if words[at] == "--prefix" then
      at = at + 1
      prefix = words[at] or fail "kernel: --prefix needs a folder"
    elseif not action then action = words[at]
    else fail("kernel: unknown word '" .. words[at] .. "'." .. did_you_mean(words[at], { "--prefix" })) end
    at = at + 1
  end
  local folder = data_folder(prefix) .. "/kernels/pendula"
  if action == "install" then install_kernel(folder)
  elseif action == "uninstall" then
    os.remove(folder .. "/kernel.json")
    os.remove(folder)
  elseif action == "--help" or action == "-h" then io.write(usage)
  else
    fail("kernel: expected install or uninstall: pendula kernel install."
      .. did_you_mean(action or "", { "install", "uninstall" }))
  end
  return 0
end

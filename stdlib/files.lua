-- save and load: models and expressions as Lua files.

local lua_load = load
local kinds = { model = true, expr = true, matrix = true, equation = true }

doc { name = "save", module = "files", title = "Files", sig = "save(file, value)",
  text = "Writes a model, an expression, a matrix or an equation to a Lua file that load (or dofile) turns into the "
    .. "same value, in a new session too. A model keeps its name, parameter values and the form it was reduced to.",
  example = [[x = var "x"
name = os.tmpname() .. ".lua"
save(name, dae{ der(x) ~ -2*x })
return load(name).kind]], gives = "ODE",
  function(file, value)
    if type(file) ~= "string" then fail 'save: expected a file name first, as in save("model.lua", sys)' end
    local kind = object_type(value)
    if type(value) == "number" then kind = "expr" end
    if not kinds[kind] then
      fail("save: a model, an expression, a matrix or an equation can be saved, not "
        .. (kind and "a " .. kind or type(value)) .. (kind == "solution" and '; sol:csv "run.csv" writes its values' or ""))
    end
    local text = type(value) == "number" and ("return %.17g\n"):format(value) or value:code()
    if kind ~= "model" and type(value) ~= "number" then text = "return " .. text .. "\n" end
    local out, why = io.open(file, "w")
    if not out then fail("save: cannot write " .. why) end
    out:write(text)
    out:close()
  end }

doc { name = "load", module = "files", sig = "load(file) -> value",
  text = "Runs a Lua file (\"model.lua\") and returns its value: what save wrote. Anything else is Lua's own load, which "
    .. "compiles a chunk.",
  example = 'load "return 1 + 1"()', gives = "2",
  function(chunk, ...)
    local is_file = type(chunk) == "string" and select("#", ...) == 0 and chunk:find "^[^\n]*%.lua$" ~= nil
    if not is_file then return lua_load(chunk, ...) end
    local file = io.open(chunk)
    if not file then fail("load: there is no file '" .. chunk .. "'") end
    file:close()
    local run, why = loadfile(chunk)
    if not run then fail("load: " .. why) end
    return run()
  end }

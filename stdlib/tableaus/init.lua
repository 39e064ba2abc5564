-- The tableaus that come with the program: one file each, listed here in the order of help(). A file returns
-- the table of coefficients; the tableau is built when rk.name is first touched.
local libraries = {
  { library = "rk", folder = "explicit",
    "euler", "midpoint", "heun", "ralston", "kutta3", "heun3", "ralston3", "ssprk33", "bogacki_shampine",
    "rk4", "kutta38", "fehlberg45", "cash_karp", "dopri5", "tsit5", "butcher6", "verner65", "verner76",
    "verner87", "dop853", "verner98" },
  { library = "rk", folder = "implicit",
    "implicit_euler", "implicit_midpoint", "trapezoid", "sdirk2", "crouzeix", "crouzeix4", "qin_zhang",
    "sdirk3", "sdirk4", "tr_bdf2", "esdirk32", "esdirk43" },
  { library = "rosenbrock", folder = "rosenbrock",
    "ros2", "ros3p", "rodas3", "rodas4", "rodas4p", "rodas5p" },
}
local titles = { rk = "Butcher tableaus", rosenbrock = "Rosenbrock methods" }

-- Lists of weights may leave out zeros at their end.
local function pad(list, size)
  for i = #list + 1, size do list[i] = 0 end
end

local function file_of(folder, name)
  local data = include("tableaus/" .. folder .. "/" .. name)
  data.text, data.cite = prose(data.text), prose(data.cite)
  return data
end

local load = {}

function load.rosenbrock(data)
  for _, row in ipairs(data.dense or {}) do pad(row, #data.m) end
  return rosenbrock(data)
end

function load.rk(data)
  for _, key in ipairs { "b", "bhat", "bhat2" } do
    if data[key] then pad(data[key], #data.A) end
  end
  data.proved = true           -- by tests/integrate/run/methods_test.lua
  return tableau(data)
end

local function register(library, folder, name)
  doc {
    name = library .. "." .. name, sig = library .. "." .. name, module = library, title = titles[library],
    text = "", example = library .. "." .. name .. ":order()",
    describe = function(entry)
      local data = file_of(folder, name)
      entry.text = data.text .. " (" .. data.cite .. ")"
      entry.gives = tostring(data.order)
    end,
    load = function() return load[library](file_of(folder, name)) end,
  }
end

local names = {}               -- of the tableaus
for _, list in ipairs(libraries) do
  for _, name in ipairs(list) do
    register(list.library, list.folder, name)
    if list.library == "rk" then names[#names + 1] = name end
  end
end

-- The adaptive methods: a family as it is, or what the library has of it.
local function methods()
  local list = { { name = "auto", family = "auto", explicit = false, index_2 = true,
    text = "chosen by the model, its spectrum and the tolerances; stats() says which and why" } }
  local function add(family, name, data)
    list[#list + 1] = { name = name, family = family.name, explicit = family.explicit,
      index_2 = family.index_2, order = data.order, text = data.text }
  end
  local function add_library(family, library, suits)
    for _, list in ipairs(libraries) do
      for _, name in ipairs(list.library == library and list or {}) do
        local data = file_of(list.folder, name)
        if suits(data, list) then add(family, name, data) end
      end
    end
  end
  for _, family in ipairs(method_families()) do
    if not family.listed then                                 -- chosen by a tableau
      add_library(family, "rk", function(data, list) return list.folder == "explicit" and data.bhat end)
    elseif family.default ~= "" then
      add_library(family, "rosenbrock", function(data) return data.mhat end)
    else
      add(family, family.name, family)
    end
  end
  return list
end
doc { name = "methods", module = "methods", title = "Multistep and Rosenbrock methods",
  sig = "methods() -> { method, … }",
  text = "The methods that choose their steps: name (as in method = name), family, text, explicit, order "
    .. "(none where it varies), and index_2: it treats models of index 2 and 3 as they stand.",
  example = "methods()[1].name", gives = "auto", methods }

-- Words, tables and pictures about methods: loaded when first asked for.
local loaded
local function analysis()
  loaded = loaded or include "tableaus/analysis"
  return loaded
end

local function require_tableaus(by, list)
  if list == nil then
    list = {}
    for i, name in ipairs(names) do list[i] = named("rk")[name] end
  end
  for i, tab in ipairs(list) do
    if object_type(tab) ~= "tableau" then
      fail(("%s: entry %d of the list is not a tableau"):format(by, i))
    end
  end
  return list
end

local title = "Stability and order of methods"
doc { name = "tableau:report", module = "stability", title = title, sig = "tab:report() -> string",
  text = [[The tableau drawn, its kind, the order conditions met and missed, R(z), stability, and the order to
    expect on DAEs of index 1, 2 and 3.]],
  example = "rk.heun:report()", gives = [=[
    heun: 2 stages, order 2, explicit

    0 │
    1 │ 1
    ──┼─────────
      │ 1/2  1/2

    Explicit trapezoidal rule: the mean of the slopes at both ends.
    (Heun, Z. Math. Phys. 45, 1900; Runge, Math. Annalen 46, 1895)

    kind             explicit
    order            2: every condition of the trees with at most 2 vertices holds
    missed           2 of order 3:
                     [[τ]]  bᵀAc = 1/6  residual -1/6
                     [τ²]   bᵀc² = 1/3  residual 1/6
    stage order      1;  B(2), C(1), D(1) hold
    R(z) = 1 + z + z²/2
    real axis        |R| ≤ 1 on [-2, 0]
    imaginary axis   |R| ≤ 1 for y = 0 only
    at infinity      R(∞) = ∞
    A-stable         no
    L-stable         no
    error            e^z - R(z) = 1/6·z³ + …
    index 1          x 2, z 2 (x′ and z at mesh points solve the equations)
    index 2, 3       not applicable as they stand: the stages do not determine z; reduce the index
    work             2 evaluations per step]=], function(tab) return analysis().report(tab) end }
doc { name = "multistep:verify", module = "stability", title = title, sig = "method:verify() -> verification",
  text = [[Measures the order of a BDF formula on nonlinear, non-autonomous, stiff and DAE problems (index 2
    and 3 as they stand).]],
  example = "bdf(2):verify().ok", gives = "true",
  function(self) return analysis().verify_multistep(self) end }

doc { name = "tableau:verify", module = "stability", title = title, sig = "tab:verify() -> verification",
  text = [[Measures the order on nonlinear, non-autonomous, stiff and DAE problems (index 1, 2, 3) and
    compares, one-sided, with the order that the order conditions predict; order reduction is explained.
    Fields: ok, rows, notes.]],
  example = "rk.heun:verify().ok", gives = "true", function(tab) return analysis().verify(tab) end }
doc { name = "tableau:plot", module = "stability", title = title, sig = "tab:plot() -> figure",
  text = "The boundary |R(z)| = 1 of the stability region.",
  example = "rk.rk4:plot()", function(tab)
    return include "tableaus/stability_figure".one_step(tab:stability(), tab.name)
  end }
doc { name = "stability_function:plot", module = "stability", title = title,
  sig = "stability:plot() -> figure",
  text = "The boundary |R(z)| = 1 of the stability region.",
  example = "rk.radau(2):stability():plot()", function(st)
    return include "tableaus/stability_figure".one_step(st, "R")
  end }
doc { name = "rosenbrock:plot", module = "stability", title = title, sig = "method:plot() -> figure",
  text = "The boundary |R(z)| = 1 of the stability region.",
  example = "rosenbrock.rodas4:plot()", function(m)
    return include "tableaus/stability_figure".one_step(m:stability(), m.name)
  end }
doc { name = "multistep:plot", module = "stability", title = title, sig = "method:plot() -> figure",
  text = "The root locus, which bounds the stability region.",
  example = "bdf(3):plot()", function(m)
    return include "tableaus/stability_figure".multistep(m)
  end }
doc { name = "rk.table", module = "rk", title = "Butcher tableaus", sig = [[rk.table([{ tableau, … }]) ->
  comparison]],
  text = "All methods, or those of the list, side by side: stages, orders, stability limits, properties.",
  example = "#rk.table{ rk.euler, rk.rk4 }.rows", gives = "3",
  function(list) return analysis().compare(require_tableaus("rk.table", list)) end }
doc { name = "rk.stages_for_order", module = "rk", title = "Butcher tableaus",
  sig = "rk.stages_for_order() -> comparison",
  text = [[The least number of stages of explicit methods of order 1 to 8 and the methods here
    that attain it.]],
  example = "rk.stages_for_order().rows[6][2]", gives = "6",
  function() return analysis().stages_for_order(require_tableaus("rk.stages_for_order")) end }
doc { name = "rk.cost", module = "rk", title = "Butcher tableaus",
  sig = "rk.cost([{ tableau, … } [, { error, … }]]) -> comparison",
  text = [[Steps, factorisations and operations that implicit methods need for given errors, measured;
    default: Gauss with 1 to 5 stages.]],
  example = "#rk.cost({ rk.gauss(1), rk.gauss(2) }, { 1e-2 }).rows", gives = "2",
  function(list, targets)
    list = list or { rk.gauss(1), rk.gauss(2), rk.gauss(3), rk.gauss(4), rk.gauss(5) }
    return analysis().cost(require_tableaus("rk.cost", list), targets or { 1e-2, 1e-4, 1e-6, 1e-8, 1e-10 })
  end }

return names

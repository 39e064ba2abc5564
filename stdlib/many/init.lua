-- What the runs of a sweep say: quantiles, probabilities, pictures, indices, surrogates; tables for other
-- programs. The computations are read when they are first asked for.

local parts = {}
local function late(part, name)
  return function(...)
    parts[part] = parts[part] or include("many/" .. part)
    return parts[part][name](...)
  end
end

local function method(name, sig, text, part, rows, example, gives)
  doc { name = "sweep:" .. name, module = "sweep", sig = sig, text = text, example = example, gives = gives,
    options = rows, options_at = rows and 3, late(part, name) }
end

local workers = option("workers", "integer", "worker processes; without it one for each processor")
local seed_row = option("seed", "integer", "of the random numbers", "0")
local confidence = option("confidence", "number", "of the interval", "0.95")
local at_time = option("t", "number", "the time of the value; without it the end")

-- Rows of a picture's own options, with those of every figure behind them.
local function pictured(rows)
  return function() return joined_options(rows, plotting.options.frame) end
end

local function runs(design)
  return ([[
x, k = var "x", param "k"
s = sweep(dae{ der(x) ~ -k*x }, { start = { x = 1 }, to = 1, params = { k = normal(1, 0.1) }, runs = 64,
  design = "%s" })
]]):format(design)
end
local three_runs = [[
x, k = var "x", param "k"
s = sweep(dae{ der(x) ~ -k*x }, { start = { x = 1 }, to = 1, params = { k = {1, 2, 3} } })
]]

method("quantile", "s:quantile(e, p [, t]) -> number or column",
  [[The value of an expression below which the share p of the runs lies, at the end or at time t; p may be a
    list.]], "answers", nil,
  runs "sobol" .. [[
low, high = s:quantile(x, 0.05), s:quantile(x, 0.95)
return low < s:mean(x) and s:mean(x) < high]], "true")
doc { name = "sweep:probability", module = "sweep",
  sig = "s:probability(condition [, t] [, { confidence = 0.95, method = \"wilson\" }]) -> probability",
  text = [[The share of the runs for which a condition such as lt(x, 0.2) holds at the end (or at time t),
    with an interval ("wilson" or "clopper-pearson"): .p .low .high .count .n. Independent runs (design "monte
    carlo") only have that interval; for even designs it is too long.]],
  example = runs "monte carlo" .. "print(s:probability(lt(x, 0.5), { confidence = 0.9 }).n)", gives = "64",
  options = options_of "share_interval", late("answers", "probability") }
method("histogram", "s:histogram(e [, { t =, bins = }]) -> figure",
  "A histogram of the values of an expression over the runs.", "pictures",
  pictured { at_time, option("bins", "integer or list", "how many cells, or their edges") },
  runs "monte carlo" .. "print(s:histogram(x, { bins = 5 }))", "figure: 1 series, 20 points")
method("density", "s:density(e [, { t =, bandwidth = }]) -> figure",
  "Draws the density of the values by Gaussian kernels.", "pictures",
  pictured { at_time, option("bandwidth", "number", "of the kernels") },
  runs "monte carlo" .. "print(s:density(x, { bandwidth = 0.1 }).title)", "")
doc { name = "sweep:fan", module = "sweep", sig = "s:fan(e [, { 0.05, 0.25, title = }]) -> figure",
  text = "The median over time between the quantiles p and 1 - p; needs saved times.",
  example = [[
x, k = var "x", param "k"
s = sweep(dae{ der(x) ~ -k*x }, { start = { x = 1 }, to = 1, times = linspace(0, 1, 21),
  params = { k = normal(1, 0.2) }, runs = 64 })
return s:fan(x, { 0.05, 0.25, title = "Decay" })]], gives = "figure 'Decay': 3 series, 63 points",
  options = pictured {}, late("pictures", "fan") }
method("scatter", "s:scatter{ e, … } -> figure",
  "One panel for each expression against each varied parameter.", "pictures", nil, [[
x, k, a = var "x", params "k a"
s = sweep(dae{ der(x) ~ a - k*x }, { start = { x = 1 }, to = 1, runs = 64,
  params = { k = normal(1, 0.1), a = uniform(0, 1) } })
return s:scatter{ x }]], "figure: 1 series, 64 points, 2 panels")
method("convergence", "s:convergence(e [, t]) -> figure",
  [[The mean over the first n runs with its 95 % interval, against n: shows whether more runs are needed.]],
  "pictures", nil, runs "monte carlo" .. "return s:convergence(x)")
method("sobol", "s:sobol(e [, { t =, bootstrap = 200, confidence = 0.95, seed = 0 }]) -> sobol_indices",
  [[Shares of the variance of an expression that each quantity explains alone (first) and with all others
    (total), with bootstrap intervals. Needs design = "saltelli" with runs = a power of 2 of base points.
    Estimators: Saltelli et al., Comput. Phys. Commun. 181, 2010 (first), Jansen, Comput. Phys. Commun. 117,
    1999 (total).]], "sensitivity",
  { at_time, option("bootstrap", "integer", "repetitions for the intervals", "200"), confidence, seed_row },
  runs "saltelli" .. "print(s:sobol(x, { bootstrap = 20 }).total[1] > 0.9)", "true")
method("morris", "s:morris(e [, t]) -> morris_effects",
  [[Mean μ, mean of the sizes μ* and deviation σ of the elementary effects of each quantity: which matter at
    all. Needs design = "morris" (Morris, Technometrics 33(2), 1991).]], "sensitivity", nil, [[
x, k, a = var "x", params "k a"
s = sweep(dae{ der(x) ~ a - k*x }, { start = { x = 1 }, to = 1, runs = 30, design = "morris",
  params = { k = uniform(1, 2), a = uniform(0, 0.1) } })
m = s:morris(x)
return m.names[2], m.mu_star[2] > 3*m.mu_star[1] ]], "k true")
method("chaos", "s:chaos(e [, { degree = 3, t = }]) -> chaos",
  [[A polynomial in the varied parameters, orthonormal for their distributions, fitted to the runs with few
    terms: c.mean, c.std, c.loo (leave-one-out error, as a share of the variance), c.terms, c:sobol(), c{ k
    = 1.2 }. Blatman & Sudret, J. Comput. Phys. 230(6), 2011 (there by least angles; here by orthogonal
    matching pursuit).]], "chaos",
  { at_time, option("degree", "integer", "the highest degree of a term", "3") },
  runs "halton" .. 'print(("%.2f"):format(s:chaos(x, { degree = 2 }).mean))', "0.37")
method("csv", "s:csv(file [, { expressions }])",
  [[Writes one line per run: the varied parameters, the values at the end, and why it failed.]], "tables",
  nil, three_runs .. [[
name = os.tmpname()
s:csv(name, { x })
for line in io.lines(name) do print(line) end]])
method("json", "s:json([file] [, { expressions }]) -> string",
  "The same as JSON: a list of objects.", "tables", nil, three_runs .. [[
name = os.tmpname()
s:json(name, { x })
for line in io.lines(name) do print(line) end]])

doc { name = "reliability", module = "sweep",
  sig = "reliability(sys, { params =, start =, to =, limit_state = g, runs = 1000, p0 = 0.1, seed = 0, t = "
    .. "}) -> result",
  text = [[The probability that g < 0 at the end (or at time t), by subset simulation: conditional samples
    approach the event level by level, so that 10⁻⁶ takes some thousand runs (Au & Beck, Probabilistic Eng.
    Mech. 16(4), 2001). r.p, r.cov (coefficient of variation, roughly), r.levels. Distributions must not be
    correlated.]],
  example = [[
    x, k = var "x", param "k"
    decay = dae{ der(x) ~ -k*x }
    r = reliability(decay, { start = { x = 1 }, to = 1, params = { k = normal(1, 0.1) },
      limit_state = x - 0.3, runs = 500, rtol = 1e-8 })
    print(r.p > 0.01 and r.p < 0.04)]], gives = "true",      -- exact: P(k > -ln 0.3) = 0.0206
  options = function()
    return joined_options(options_of "sweep", {
      option("limit_state", "expression", "g, which is < 0 at failure"),
      option("p0", "number", "share of the samples that go on to the next level", "0.1"),
      option("t", "number", "when g counts; without it the end") }, { runs = "samples of a level" })
  end,
  options_at = 2, late("reliability", "reliability") }

-- ── what the computations return ───────────────────────────────────────────────────────────────────────────

local function fields(type, list)
  for _, entry in ipairs(list) do
    doc { name = type .. "#" .. entry[1], module = "sweep", sig = "r." .. entry[1] .. " -> " .. entry[2],
      text = entry[3], function(self) return contents(type, self)[entry[1]] end }
  end
  doc { name = type .. ":__tostring", module = "sweep", sig = "print(r)", text = "The table.",
    function(self) return contents(type, self).text end }
end

fields("probability", { { "p", "number", "The share." }, { "low", "number", "Lower end of the interval." },
  { "high", "number", "Upper end of the interval." }, { "count", "integer", "Runs for which it holds." },
  { "n", "integer", "Runs with a value." } })
fields("sobol_indices", { { "names", "list", "The varied parameters." },
  { "first", "list", "First-order indices." },
  { "total", "list", "Total indices." }, { "first_interval", "list", "{ low, high } of each first index." },
  { "total_interval", "list", "{ low, high } of each total index." } })
fields("morris_effects", { { "names", "list", "The varied parameters." }, { "mu", "list", "Mean effects." },
  { "mu_star", "list", "Means of the sizes." }, { "sigma", "list", "Deviations." } })
fields("reliability_result", { { "p", "number", "The probability." },
  { "cov", "number", "Its coefficient of variation; levels count as independent." },
  { "levels", "integer", "Levels of conditional samples." }, { "runs", "integer", "Runs made." } })
fields("chaos", { { "mean", "number", "The mean." }, { "std", "number", "The standard deviation." },
  { "loo", "number", "Leave-one-out error, a share of the variance." },
  { "terms", "integer", "Terms that were kept." } })
doc { name = "chaos:sobol", module = "sweep", sig = "c:sobol() -> sobol_indices",
  text = "Sobol' indices from the coefficients.",
  example = [[
    x, k = var "x", param "k"
    s = sweep(dae{ der(x) ~ -k*x }, { start = { x = 1 }, to = 1, params = { k = normal(1, 0.1) }, runs = 64,
      design = "halton" })
    s:chaos(x, { degree = 2 }):sobol().total[1] ]], gives = "1.0", late("chaos", "indices") }
doc { name = "chaos:__call", module = "sweep", sig = "c{ k = 1.2, … } -> number",
  text = "The value of the polynomial.",
  example = [[
    x, k = var "x", param "k"
    s = sweep(dae{ der(x) ~ -k*x }, { start = { x = 1 }, to = 1, params = { k = normal(1, 0.1) }, runs = 64,
      design = "halton" })
    c = s:chaos(x, { degree = 3 })
    math.abs(c{ k = 1.1 } - math.exp(-1.1)) < 1e-4]], gives = "true", late("chaos", "value") }

-- ── many fits ──────────────────────────────────────────────────────────────────────────────────────────────

local function of_fit(name, sig, text, options, example, gives)
  doc { name = "fit_result:" .. name, module = "identification", sig = sig, text = text, options = options,
    example = example, gives = gives,
    function(r, ...)
      parts.refits = parts.refits or include "many/refits"
      local arguments = { ... }
      local last = math.max(#arguments, name == "profile" and 2 or 1)
      if name == "profile" and arguments[1] == nil then fail "profile: which parameter? r:profile(k)" end
      if arguments[last] ~= nil and type(arguments[last]) ~= "table" then
        fail(("%s: options are a table, { %s = … }"):format(name, options[1].name))
      end
      arguments[last] = check_options(name, arguments[last], options)
      return parts.refits[name](r, table.unpack(arguments, 1, last))
    end }
end

local decay_fit = [[
    x, k = var "x", param("k", 1)
    d = iddata{ y = { 2.02, 1.49, 1.09, 0.83, 0.59, 0.46 }, Ts = 1 }
    r = fit(dae{ der(x) ~ -k*x }, { params = { k }, data = d, y = x, start = { x = 2 } })
]]

of_fit("profile", "r:profile(k [, { points = 21, range =, confidence = 0.95 }]) -> profile_result",
  [[The least loss for each value of one parameter, the others fitted anew: p.low and p.high end where
    N ln(V/V̂) reaches the quantile of χ² with one degree of freedom; an end that is never reached is nil and
    the parameter not identifiable on that side. p:plot() draws it. Venzon & Moolgavkar, Appl. Statist. 37(1),
    1988; Raue et al., Bioinformatics 25(15), 2009.]],
  { option("points", "integer", "values of the parameter", "21"),
    option("range", "list", "the least and the largest value; else as wide as needed"), confidence, workers },
  decay_fit .. [[
    p = r:profile(k)
    print(p.low < r(k) and r(k) < p.high)]], "true")
of_fit("bootstrap", "r:bootstrap{ runs = 200, seed = 0, confidence = 0.95 } -> bootstrap_result",
  [[Fits to the simulated outputs plus residuals drawn with replacement: b.std, b.low and b.high (quantiles),
    b.values of each estimate. For residuals that are independent of each other. Efron & Tibshirani, An
    Introduction to the Bootstrap, 1993, §9.4.]],
  { option("runs", "integer", "fits", "200"), seed_row, confidence, workers },
  decay_fit .. [[
    b = r:bootstrap{ runs = 40 }
    print(b.low[1] < r(k) and r(k) < b.high[1])]], "true")
of_fit("cross_validate", "r:cross_validate{ folds = 5 } -> cross_validation",
  [[Each of `folds` blocks of samples is left out of one fit and predicted by it: c.rmse of the samples
    left out, c.folds by block.]],
  { option("folds", "integer", "blocks", "5"), workers },
  decay_fit .. "print(r:cross_validate{ folds = 3 }.rmse < 0.1)", "true")
of_fit("starts", "r:starts{ runs = 20, spread = 1, lower =, upper =, seed = 0 } -> starts_result",
  [[Fits from random guesses, even between lower and upper ({ k = 0.1 }) where both are given, else about the
    estimates by factors exp(±spread): s.best is the best fit, s.minima lists the minima and how often each
    was found.]],
  { option("runs", "integer", "fits", "20"),
    option("spread", "number", "standard deviation of the logarithm of the factor", "1"),
    option("lower", "table", "least guesses by parameter"), option("upper", "table", "largest guesses"),
    seed_row, workers },
  decay_fit .. "print(#r:starts{ runs = 5 }.minima)", "1")

fields("profile_result", { { "best", "number", "The estimate." },
  { "low", "number or nil", "Lower end of the interval." },
    { "high", "number or nil", "Upper end of the interval." },
  { "values", "list", "Values of the parameter." }, { "losses", "list", "The least losses." },
  { "level", "number", "The loss at the ends of the interval." } })
doc { name = "profile_result:plot", module = "identification", sig = "p:plot([options]) -> figure",
  text = "The loss against the parameter, with the level at the ends of the interval.",
  options = include("plot/options").flat, options_at = 2,
  example = decay_fit .. "print(r:profile(k, { points = 5 }):plot())", gives = "",
  function(self, options)
    parts.refits = parts.refits or include "many/refits"
    return parts.refits.plot_profile(contents("profile_result", self), options)
  end }
fields("bootstrap_result", { { "names", "list", "The estimates." },
  { "std", "list", "Their standard deviations." }, { "low", "list", "Lower ends of their intervals." },
  { "high", "list", "Upper ends of their intervals." }, { "values", "list", "All estimates, a list each." } })
fields("cross_validation", { { "rmse", "number", "Of the samples left out." },
  { "folds", "list", "The same by block." } })
fields("starts_result", { { "best", "fit_result", "The best fit." },
  { "minima", "list", "{ loss =, theta =, count = }, the best first." } })

-- ── other machines ─────────────────────────────────────────────────────────────────────────────────────────

doc { name = "slurm", module = "sweep",
  sig = "slurm{ partition =, tasks = 16, time = \"2h\", modules = {…}, memory =, account =, cpus =, options "
    .. "= {…}, "
    .. "shards =, retries = 3, program = }",
  text = [[For sweep{ …, store = "runs.db", on = slurm{ … } }: the runs become a job array of at most `tasks`
    tasks at a time, each for one of `shards` shards. Lost tasks (node, preemption, time limit) are
    submitted again, at most `retries` times. Nothing but the queue and the folder runs.db.d connects the two
    sides: the session may end, and attach "runs.db" continues in a new one.]],
  example = [[print(slurm{ tasks = 4, time = "10min" })]], gives = "slurm: 4 tasks at a time",
  options = { option("partition", "string", "where the jobs run"),
    option("account", "string", "who pays"),
    option("time", "string", "limit of a task, as sbatch reads it or \"2h\""),
    option("memory", "string", "of a task: \"4G\""),
    option("modules", "string or list", "modules to load before"),
    option("options", "string or list", "more options of sbatch"),
    option("program", "string", "the path of pendula on the nodes"),
    option("tasks", "integer", "tasks at a time", "16"),
    option("shards", "integer", "pieces of the work"),
    option("cpus", "integer", "processors of a task"),
    option("retries", "integer", "how often lost tasks are submitted again", "3") },
  options_at = 1,
  function(options)
    parts.cluster = parts.cluster or include "many/cluster"
    return record("slurm", parts.cluster.read(options))
  end }
doc { name = "slurm:__tostring", module = "sweep", sig = "print(on)", text = "In words.",
  function(self)
    local on = contents("slurm", self)
    return ("slurm: %d tasks at a time%s"):format(on.tasks or 16,
      on.partition and " in " .. on.partition or "")
  end }
doc { name = "attach", module = "sweep", sig = "attach(file) -> sweep",
  text = [[Follows a sweep that a cluster makes until it is finished (after Ctrl-C the cluster continues) and
    gives it back; lost tasks are submitted again. Of shards that are made by hand it takes those that are
    finished. Also `pendula sweep attach runs.db`.]],
  example = "print(type(attach))", gives = "function",
  function(file)
    if type(file) ~= "string" then
      fail 'attach: expected the file of a sweep{ …, on = slurm{ … } }, as in attach "runs.db"'
    end
    info_of_store("attach", file)
    parts.cluster = parts.cluster or include "many/cluster"
    parts.cluster.follow(file)
    return load(file)
  end }
doc { name = "shards.run", module = "sweep", sig = "shards.run(path [, workers]) -> string",
  text = [[Makes the runs of one shard, "runs.db.d/17": "done", "done before", or "done by another" where two
    worked on it. From a shell: pendula shard runs.db.d/17.]],
  example = "print(type(shards.run))", gives = "function", late("cluster", "run_shard") }

-- ── inputs ─────────────────────────────────────────────────────────────────────────────────────────────────

doc { name = "random_process", module = "sweep",
  sig = "random_process{ band = { low, high }, std = | spectrum = function(f) … end, lines = 32, mean = 0 } "
    .. "-> random_process",
  text = [[A Gaussian process as an input of sweep, each run with numbers of its own: inputs = { [r] =
    random_process{ band = { 0.1, 5 }, std = 2 } }. Even within the band (Hz), or with a one-sided spectrum
    S(f) in unit²/Hz; a sum of `lines` sines that repeats after lines/(high - low) seconds.
    p:realisation(seed) is one of them as an expression of t, for integrate.]],
  example = "random_process{ band = { 0.1, 5 }, std = 2 }", gives = "random process of 32 lines, std 2",
  options = { option("band", "list", "{ low, high }, in Hz"),
    option("std", "number", "standard deviation, of an even spectrum"),
    option("spectrum", "function", "one-sided, in unit²/Hz, a function of f"),
    option("lines", "integer", "sines", "32"), option("mean", "number", "its mean", "0") },
  options_at = 1,
  function(options)
    parts.process = parts.process or include "many/process"
    return record("random_process", parts.process.read(options))
  end }
doc { name = "random_process:realisation", module = "sweep", sig = "p:realisation([seed]) -> expression",
  text = "One of its signals, as an expression of t.",
  example = [[
    w = random_process{ band = { 0.1, 5 }, std = 2, lines = 2 }
    evaluate(w:realisation(1), { t = 0 }) ~= evaluate(w:realisation(2), { t = 0 })]], gives = "true",
  function(self, seed_)
    parts.process = parts.process or include "many/process"
    return parts.process.realisation(contents("random_process", self), seed_ or 0)
  end }
doc { name = "random_process:__tostring", module = "sweep", sig = "print(p)", text = "In words.",
  function(self)
    local p, variance = contents("random_process", self), 0
    for _, sigma in ipairs(p.sigmas) do variance = variance + sigma^2 end
    return ("random process of %d lines, std %.6g"):format(#p.sigmas, math.sqrt(variance))
  end }

-- LaTeX of what is printed in lines: matrix forms, conditions, multistep methods.

-- A column as it stands in an equation; alone it is written in a line, (a, b).
local function upright(column)
  if #column == 1 then return latex(column) end
  local rows = {}
  for i = 1, #column do rows[i] = latex(column[i]) end
  return "\\begin{bmatrix} " .. table.concat(rows, " \\\\ ") .. " \\end{bmatrix}"
end

doc { name = "matrix_form:latex", module = "mech", sig = "form:latex() -> string",
  text = "The three blocks in LaTeX.",
  example = 'x = var "x"  return lagrange { q = {x}, T = x.dot^2/2, V = x }.matrix_form:latex()',
  gives = "1 \\ddot{x} = -1",
  function(form) return latex(form.A) .. " " .. upright(form.unknowns) .. " = " .. upright(form.c) end }

doc { name = "constraints:latex", module = "DAE", sig = "sys:constraints():latex() -> string",
  text = "The conditions on the initial values in LaTeX, one below the other.",
  example = 'x, z = vars "x z"  return dae{ der(x) ~ z, 0 ~ x - sin(t) }:constraints():latex()',
  gives = "\\begin{align*}\n  0 &= x - \\sin t\n\\end{align*}",
  function(list)
    local rows = {}
    for i = 1, #list do rows[i] = "  0 &= " .. latex(list[i].rhs) end
    return "\\begin{align*}\n" .. table.concat(rows, " \\\\\n") .. "\n\\end{align*}"
  end }

-- "x_{k+1} - \frac{4}{3} x_k", the coefficients times the names at k + 1, k, k - 1 …
local function weighted(coefficients_, name)
  local text = ""
  for i = 1, #coefficients_ do
    local c = coefficients_[i]
    if c ~= 0 then
      local shown = latex(c)
      local minus = shown:sub(1, 1) == "-"
      if minus then shown = shown:sub(2) end
      local place = i == 1 and "k+1" or i == 2 and "k" or "k-" .. i - 2
      text = text .. (text == "" and (minus and "-" or "") or minus and " - " or " + ")
        .. (shown == "1" and "" or shown .. " ") .. name .. "_{" .. place .. "}"
    end
  end
  return text
end

doc { name = "multistep:latex", module = "methods", sig = "method:latex() -> string",
  text = "The formula of the method in LaTeX.",
  example = "bdf(2):latex()",
    gives = "\\frac{3}{2} x_{k+1} - 2 x_{k} + \\frac{1}{2} x_{k-1} = \\Delta t f_{k+1}",
  function(method)
    local right, several = weighted(method.beta, "f"), 0
    for i = 1, #method.beta do if method.beta[i] ~= 0 then several = several + 1 end end
    return weighted(method.alpha, "x") .. " = \\Delta t "
      .. (several > 1 and "\\left(" .. right .. "\\right)" or right)
  end }

-- Kinds whose LaTeX text is made when it is first asked for, by module: what print says, or what latex_kinds
-- writes in another way.
local kinds = {
  { "newton", "newton, basins" }, { "gauss_newton", "gauss_newton" }, { "pencil", "pencil" },
  { "stability", "stability_function, conditions" }, { "methods", "rosenbrock" },
  { "integrate", "convergence, solution, stats, drift, check" }, { "linear algebra", "eigenvalues" },
  { "expressions", "func" }, { "calculus", "fn" }, { "complex numbers", "complex, roots" },
  { "lti analysis", "damping, margins, lti_stability, reachability" },
  { "lti responses", "response, frequency response" }, { "lti delays", "delay system" },
  { "signals", "spectrum" }, { "lti design", "kalman_result" },
  { "identification", "iddata, lsq_result, nlsq_result, comparison, order_scan_result, parameter_set, "
    .. "fit_result, idpoly, predictor_fit, validation, validations, density, profile_result, bootstrap_result, cross_validation, "
    .. "starts_result" },
  { "random", "distribution, joint_distribution, joint_component" },
  { "sweep", "sweep, sweep_stats, probability, sobol_indices, morris_effects, chaos, reliability_result, "
    .. "random_process, slurm" },
  { "plot", "figure, surface" },
}
for _, group in ipairs(kinds) do
  for kind in group[2]:gmatch "[^,%s][^,]*" do
    doc { name = kind .. ":latex", module = group[1], sig = "x:latex() -> string",
      text = "The printed form in LaTeX.",
      describe = function(row) include "latex_kinds".describe(row, kind) end,
      function(value) return include "latex_kinds".fragment(kind, value) end }
  end
end

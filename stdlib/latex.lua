-- LaTeX of what is printed in lines: matrix forms, conditions, multistep methods.

-- A column as it stands in an equation; alone it is written in a line, (a, b).
local function upright(column)
  if #column == 1 then return latex(column) end
  local rows = {}
  for i = 1, #column do rows[i] = latex(column[i]) end
  return "\\begin{bmatrix} " .. table.concat(rows, " \\\\ ") .. " \\end{bmatrix}"
end

doc { name = "matrix_form:latex", module = "DAE", sig = "form:latex() -> string",
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

doc { name = "multistep:latex", module = "method theory", sig = "method:latex() -> string",
  text = "The formula of the method in LaTeX.",
  example = "bdf(2):latex()",
    gives = "\\frac{3}{2} x_{k+1} - 2 x_{k} + \\frac{1}{2} x_{k-1} = \\Delta t f_{k+1}",
  function(method)
    local right, several = weighted(method.beta, "f"), 0
    for i = 1, #method.beta do if method.beta[i] ~= 0 then several = several + 1 end end
    return weighted(method.alpha, "x") .. " = \\Delta t "
      .. (several > 1 and "\\left(" .. right .. "\\right)" or right)
  end }

-- What is printed as a report: tables, matrices and sentences, by what print says.
local reports = {
  { "newton", "method theory", 'x = var "x"  return newton{ r = { x^2 - 2 }, x = {x}, start = {1} }' },
  { "gauss_newton", "method theory",
    'x = var "x"  return gauss_newton{ R = { x - 1, x - 3 }, x = {x}, start = {0} }' },
  { "basins", "method theory",
    'x, y = vars "x y"  return newton{ r = { x^2 - y, y - 1 }, x = {x, y}, start = {1, 1} }'
    .. ":basins{ x = {-2, 2}, y = {-2, 2}, n = 5 }" },
  { "pencil", "DAE", 'x, y = vars "x y"  return dae{ der(x) ~ y, 0 ~ x + y }:pencil()' },
  { "lsq_result", "identification", "return lsq({ {1, 0}, {1, 1}, {1, 2} }, { 1, 2, 4 })" },
  { "stability_function", "method theory", "return rk.rk4:stability()" },
  { "rosenbrock", "method theory", "return rosenbrock.rodas4" },
  { "roots", "linear systems", "return tf({1}, {1, 3, 2}):poles()" },
  { "margins", "linear systems", "return margin(tf({2}, {1, 2, 1, 0}))" },
  { "eigenvalues", "linear algebra", "return eig(mat{ {0, 1}, {-2, -3} })" },
  { "comparison", "identification",
    "d = iddata{ y = {0, 1, 0, 2, 1, 0}, u = {1, 0, 2, 1, 0, 0} }  "
    .. "return compare(d, { a = arx(d, { na = 0, nb = 1, nk = 1 }) })" },
  { "order_scan_result", "identification",
    "d = iddata{ y = {0, 1, 0, 2, 1, 0, 1, 3, 1}, u = {1, 0, 2, 1, 0, 1, 3, 1, 0} }"
    .. "  return order_scan(d, d, { na = {0, 1}, nb = {1, 1}, nk = {1, 1} })" },
  { "parameter_set", "identification", "d = iddata{ y = {0, 1, 0.5, 2, 1, 0}, u = {1, 0, 2, 1, 0, 0} }"
    .. "  return arx(d, { na = 1, nb = 1, nk = 1, noise = uniform(-1, 1) })" },
  { "fit_result", "identification",
    'x = var "x"  k = param("k", 1)  return fit(dae{ der(x) ~ -k*x }, { params = {k}, '
    .. "y = x, start = { x = 1 }, data = iddata{ y = {1, 0.37, 0.14, 0.05}, Ts = 0.5 } })" },
  { "idpoly", "identification", "return idpoly{ A = {1, param 'a1'}, B = {0, 1} }" },
  { "validation", "identification", "d = iddata{ y = randn(60), u = randn(60) }  "
    .. "return arx(d, { na = 1, nb = 1, nk = 1 }):validate(d)" },
  { "drift", "integration", 'x, y = vars "x y"  s = dae{ der(x) ~ y, 0 ~ x + y - 1 }  '
    .. "return s:integrate{ start = { x = 0 }, to = 1 }:drift()" },
  { "check", "integration",
    'x = var "x"  return dae{ der(x) ~ -x }:integrate{ start = { x = 1 }, to = 1 }:check()' },
}
for _, each in ipairs(reports) do
  doc { name = each[1] .. ":latex", module = each[2], sig = "x:latex() -> string",
    text = "What print says in LaTeX: tables, matrices, sentences with their formulas. It needs amsmath.",
    example = each[3]:gsub("return (.*)$", "return (%1):latex():find 'noindent' ~= nil"), gives = "true",
    function(value) return include "latex_report".fragment(tostring(value)) end }
end

-- The pictures of the laboratories: what newton{…}, k:basins{…}, converge(…) and sweep(…) draw.

-- ── Newton ─────────────────────────────────────────────────────────────────────────────────────────────────

doc { name = "newton:plot", module = "newton", sig = "k:plot() -> figure",
  text = [[‖r‖ of every iterate on a logarithmic axis: a straight line is linear convergence, a falling
    parabola quadratic.]],
  example = [[x = var "x"  return newton{ r = x^2 - 2, x = x, start = 3 }:plot()]], gives = "",
  function(k)
    local residuals, iterations, values = k.residuals, {}, {}
    for i = 1, #residuals do
      iterations[i], values[i] = i - 1, residuals[i]
    end
    return semilogy(iterations, values, { xlabel = "iteration", ylabel = "‖r‖", style = "line+points",
                                          title = "Newton's method: " .. k.status })
  end }

doc { name = "basins:plot", module = "newton", sig = "b:plot() -> figure",
  text = "The starts coloured by the root they lead to; starts that do not converge stay white.",
  example = [[
    x, y = vars "x y"
    k = newton{ r = { x^2 - y^2 - 1, 2*x*y }, x = { x, y }, start = { 1, 1 } }
    k:basins{ x = { -2, 2 }, y = { -2, 2 }, n = 40 }:plot()]],
  gives = "figure 'Basins of Newton's method': 2 series, 1600 points",
  function(b)
    local u, v, root, series = b.first, b.second, b.root, {}
    for number, point in ipairs(b.roots) do
      local x, y = {}, {}
      for j = 1, #v do
        for i = 1, #u do
          if root(j, i) == number then x[#x + 1], y[#y + 1] = u[i], v[j] end
        end
      end
      local function short(value) return ("%.4g"):format(math.abs(value) < 1e-9 and 0 or value) end
      series[#series + 1] = { x = x, y = y, style = "cells",
        labels = { ("(%s, %s)"):format(short(point[1]), short(point[2])) },
                              cell = { u[2] - u[1], v[2] - v[1] } }
    end
    if #series == 0 then fail "plot: Newton's method finds no root from any start of this grid" end
    return figure { by = "plot", series = series, title = "Basins of Newton's method", xlabel = b.names[1],
      ylabel = b.names[2],
                    xlim = { u[1], u[#u] }, ylim = { v[1], v[#v] } }
  end }

-- ── sweep ──────────────────────────────────────────────────────────────────────────────────────────────────

doc { name = "sweep:plot", module = "sweep", sig = "s:plot(e [, t]) -> figure",
  text = [[The value of an expression at the end (or at time t) over the first varied parameter. Trajectories:
    plot(s.t, s(e)).]],
  example = [[
    x, k = var "x", param "k"
    s = sweep(dae{ der(x) ~ -k*x }, { start = { x = 1 }, to = 1, params = { k = {1, 2, 3} } })
    s:plot(x)]], gives = "figure: 1 series, 3 points",
  function(s, e, at)
    if e == nil then fail "plot: expected an expression to draw: s:plot(x)" end
    local name, values = s.names[1], at and s(e, at) or s:final(e)
    return plot(s.params[name], values, { xlabel = name,
      ylabel = tostring(e) .. (at and (" at t = %g"):format(at) or " at the end"),
                                          style = "points" })
  end }

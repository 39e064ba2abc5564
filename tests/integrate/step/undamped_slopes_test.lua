-- x′ or y′ alone is not determined by the equations, cos(t) y′ - sin(t) x′ only by the derivative of the
-- second one. R(∞) of Gauss is ±1 for errors of such slopes.
test("gauss that ends by errors of undamped slopes names methods that damp them", function()
  local x, y = vars "x y"
  local sys = dae { cos(t)*der(x) + sin(t)*der(y) ~ -x, 0 ~ cos(t)*y - sin(t)*x - sin(t) }
  local function run(method) return sys:integrate { start = { x = 1 }, to = 20, method = method } end
  expect(run "gauss".status):matches 'does not damp errors of such unknowns; take method = "radau" or "bdf"'
  for _, method in ipairs { "radau", "bdf" } do
    expect(run(method).status):equals "finished"
    expect(run(method):final(x)):near(3.56274, 1e-4)
  end
end)

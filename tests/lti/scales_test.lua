-- Time scales from nanoseconds to years: the numbers of an exact matrix may be large.

local function four(u)
  return ss({ { -3.5*u, 0.3*u, 0.1*u, 0.2*u }, { 0.2*u, -3.1*u, 0.5*u, 0.4*u },
    { 0.7*u, 0.1*u, -2.9*u, 0.3*u }, { 0.11*u, 0.3*u, 0.2*u, -3*u } },
    { { u }, { 2*u }, { 3*u }, { u } }, { { 1, 0, 0, 0 } }, { { 0 } })
end

test("poles, zeros, norms in every unit of time", function()
  local one = four(1)
  local poles, zeros, norm = one:poles(), one:zeros(), one:norm(2)
  for _, u in ipairs { 1e-12, 1e-5, 1e3, 1e8, 1e12, 1.2345e8 } do
    local G = four(u)
    local p, z = G:poles(), G:zeros()
    for k = 1, 4 do
      expect(p.re[k] / u):near(poles.re[k] + 0.0, 1e-11)
      expect(p.im[k] / u):near(poles.im[k] + 0.0, 1e-11)
    end
    for k = 1, 3 do expect(z.re[k] / u):near(zeros.re[k] + 0.0, 1e-10) end
    expect(G:norm(2) / math.sqrt(u)):near(norm + 0.0, 1e-10)
    expect(G:is_stable()):is_true()
  end
end)

test("sampling in every unit of time, of states and of fractions", function()
  for _, method in ipairs { "zoh", "foh", "tustin", "euler", "backward", "impulse", "matched" } do
    local want
    for _, u in ipairs { 1, 1e-9, 1e7, 1e9 } do
      for _, G in ipairs { four(u), four(u):tf() } do
        if method ~= "matched" or G.tf then
          local got = c2d(G, 0.2 / u, method):freqresp{ 1.5 * u }.mag(1, 1)
          want = want or got
          expect(got):near(want, 1e-8)
        end
      end
    end
  end
  local back = d2c(c2d(four(1e9):tf(), 2e-10, "tustin"), "tustin")
  expect(back:freqresp{ 1e9 }.mag(1, 1)):near(four(1):freqresp{ 1 }.mag(1, 1), 1e-8)
end)

test("the zeros of exact polynomials with large coefficients", function()
  for _, u in ipairs { 1, 10^9, 10^15 } do
    local r = tf({ 1 }, { 1, 10 * u, 35 * u^2, 50 * u^3, 24.5 * u^4 }):poles()
    local one = tf({ 1 }, { 1, 10, 35, 50, 24.5 }):poles()
    for k = 1, 4 do
      expect(r.re[k] / u):near(one.re[k] + 0.0, 1e-11)
      expect(r.im[k] / u):near(one.im[k] + 0.0, 1e-11)
    end
  end
end)

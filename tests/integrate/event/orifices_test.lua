-- Orifices in series: the pressure between them is algebraic, and at rest the equations do not determine it.
local h, p, q = vars "h p q"

test("two orifices in series: the message at zero flow has a remedy that every method passes with", function()
  local function root(u) return sign(u)*sqrt(abs(u)) end
  local function laminar(u) return u/(u^2 + 1e-8)^(1/4) end
  local function run(law, method)
    local sys = dae { der(h) ~ -q - 0.2, q ~ law(h - p), q ~ law(p) }
    local start = sys:init { fix = { h = 1 }, guess = { p = 0.5, q = 0.7 } }
    return sys:integrate { start = start, to = 5, method = method }
  end
  local one = dae { der(h) ~ -root(h/2) - 0.2 }
  local wanted = one:integrate { start = { h = 1 }, to = 5, rtol = 1e-10 }:final(h)
  for _, method in ipairs { "auto", "radau", "bdf", "rodas" } do
    local sol = run(root, method)
    if sol.status == "finished" then
      expect(sol:final(h)):near(wanted, 1e-5)
    else
      expect(sol.status):matches("has no derivative %(for sign%(u%)%*sqrt%(abs%(u%)%) write u/%(u%^2 %+ s%^2%)"
        .. "%^%(1/4%), s small: it has one%)")
    end
    local smooth = run(laminar, method)
    expect(method .. " " .. smooth.status):equals(method .. " finished")
    expect(smooth:final(h)):near(wanted, 1e-5)
    expect(smooth:final(p)):near(wanted/2, 1e-5)
  end
end)

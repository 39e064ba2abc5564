-- Electrical circuits.
local list = {}
local function add(problem) list[#list + 1] = problem end

--- Cs: parasitic capacitors; without them the index is 2.
local function ring_modulator(name, Cs)
  add {
    name = name, to = 1e-3,
    source = "Horneber, 1985; Mazzia & Magherini, Test Set for IVP Solvers",
    model = function(problem)
      local U, I = var("U", 7), var("I", 8)
      local C, Cp, Lh, Ls1, Ls = 1.6e-8, 1e-8, 4.45, 0.002, 5e-4
      local R, Rp, Rg1, Rg2, Ri, Rc = 25000, 50, 36.3, 17.3, 50, 600
      local in1, in2 = sin(2000*pi*t)/2, 2*sin(20000*pi*t)
      local function q(d) return 40.67286402e-9*(exp(17.7493332*d) - 1) end
      local q1, q2 = q(U[3] - U[5] - U[7] - in2), q(-U[4] + U[6] - U[7] - in2)
      local q3, q4 = q(U[4] + U[5] + U[7] + in2), q(-U[3] - U[6] + U[7] + in2)
      problem.start = { [I] = { 0, 0, 0, 0, 0, 0, 0, 0 }, [U[1]] = 0, [U[2]] = 0, [U[7]] = 0 }
      if Cs then problem.start = { [U] = { 0, 0, 0, 0, 0, 0, 0 }, [I] = { 0, 0, 0, 0, 0, 0, 0, 0 } }
      else problem.start = { [U[1]] = 0, [U[2]] = 0, [U[7]] = 0, [I[1]] = 0, [I[2]] = 0, [I[3]] = 0,
        [I[4]] = 0, [I[5]] = 0, [I[7]] = 0, [I[8]] = 0 } end
      local function node(k) return Cs and Cs*der(U[k]) or 0 end
      return dae {
        C*der(U[1]) ~ I[1] - I[3]/2 + I[4]/2 + I[7] - U[1]/R,
        C*der(U[2]) ~ I[2] - I[5]/2 + I[6]/2 + I[8] - U[2]/R,
        node(3) ~ I[3] - q1 + q4, node(4) ~ -I[4] + q2 - q3,
        node(5) ~ I[5] + q1 - q3, node(6) ~ -I[6] - q2 + q4,
        Cp*der(U[7]) ~ -U[7]/Rp + q1 + q2 - q3 - q4, Lh*der(I[1]) ~ -U[1], Lh*der(I[2]) ~ -U[2],
        Ls*der(I[3]) ~ U[1]/2 - U[3] - Rg2*I[3], Ls*der(I[4]) ~ -U[1]/2 + U[4] - Rg2*I[4],
        Ls*der(I[5]) ~ U[2]/2 - U[5] - Rg2*I[5], Ls*der(I[6]) ~ -U[2]/2 + U[6] - Rg2*I[6],
        Ls1*der(I[7]) ~ -U[1] + in1 - (Ri + Rg1)*I[7], Ls1*der(I[8]) ~ -U[2] - (Rc + Rg1)*I[8] }
    end,
    atol = function(rtol) return rtol*1e-3 end,
    stiff = true, count = { "U1", "U2", "U7", "I1", "I2", "I3", "I7" },
  }
end
ring_modulator("ring modulator, index 2", nil)
ring_modulator("ring modulator, 2 pF", 2e-12)

add {
  name = "ring oscillator", to = 50,
  source = "nine inverters in a ring, each with a stage of no delay: index 1",
  model = function(problem)
    local N = 9
    local v, w = var("v", N), var("w", N)
    local start, equations = {}, {}
    for k = 1, N do
      start[k] = math.sin(2*k)
      equations[#equations + 1] = der(v[k]) ~ 4*(w[k] - v[k])
      equations[#equations + 1] = 0 ~ w[k] + w[k]^3/10 + tanh(3*v[k > 1 and k - 1 or N])
    end
    problem.start = { [v] = start }
    return dae(equations)
  end,
  stiff = true, count = { "v1", "v2", "v5", "w9" },
}

return list

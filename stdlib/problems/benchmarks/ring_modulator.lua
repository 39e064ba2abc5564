return {
  title = "Ring modulator without parasitic capacitors",
  source = "Horneber, 1985; Mazzia & Magherini, Test Set for IVP Solvers, there with C_s = 0",
  statement = [[Four diodes in a ring between two transformers. The four node equations (3)-(6) determine only
    three of the four voltages U₃ … U₆: their sum with signs is a condition on the inductor currents. Values
    at the end: four reduced forms at rtol = 1e-11 agree.]],
  tags = "circuit nonlinear failure",
  index = 2, dof = 10, structural_index = 1, structural_dof = 11, verdict = "identically singular",
  remark = [[The voltages of the four diodes add up to a number without U₃ … U₆, so ∂g/∂(U₃ … U₆) = Aᵀ
    diag(q′) A has rank 3.]],
  to = 2e-5, dt = 1e-7, digits = 8, forms = { "", "acc", "dummy" },
  build = function()
    local U, I = var("U", 7), var("I", 8)
    local C, Cp, Lh, Ls1, Ls = 1.6e-8, 1e-8, 4.45, 0.002, 5e-4
    local R, Rp, Rg1, Rg2, Ri, Rc = 25000, 50, 36.3, 17.3, 50, 600
    local in1, in2 = sin(2000*pi*t)/2, 2*sin(20000*pi*t)
    local function q(d) return 40.67286402e-9*(exp(17.7493332*d) - 1) end
    local q1, q2 = q(U[3] - U[5] - U[7] - in2), q(-U[4] + U[6] - U[7] - in2)
    local q3, q4 = q(U[4] + U[5] + U[7] + in2), q(-U[3] - U[6] + U[7] + in2)
    local fix = { [U[1]] = 0, [U[2]] = 0, [U[7]] = 0 }
    for _, k in ipairs { 1, 2, 3, 4, 5, 7, 8 } do fix[I[k]] = 0 end
    return {
      model = dae {
        C*der(U[1]) ~ I[1] - I[3]/2 + I[4]/2 + I[7] - U[1]/R,
          C*der(U[2]) ~ I[2] - I[5]/2 + I[6]/2 + I[8] - U[2]/R,
        0 ~ I[3] - q1 + q4, 0 ~ -I[4] + q2 - q3, 0 ~ I[5] + q1 - q3, 0 ~ -I[6] - q2 + q4,
        Cp*der(U[7]) ~ -U[7]/Rp + q1 + q2 - q3 - q4, Lh*der(I[1]) ~ -U[1], Lh*der(I[2]) ~ -U[2],
        Ls*der(I[3]) ~ U[1]/2 - U[3] - Rg2*I[3], Ls*der(I[4]) ~ -U[1]/2 + U[4] - Rg2*I[4],
        Ls*der(I[5]) ~ U[2]/2 - U[5] - Rg2*I[5], Ls*der(I[6]) ~ -U[2]/2 + U[6] - Rg2*I[6],
        Ls1*der(I[7]) ~ -U[1] + in1 - (Ri + Rg1)*I[7], Ls1*der(I[8]) ~ -U[2] - (Rc + Rg1)*I[8],
          name = "ring modulator" },
      constraints = { I[3] + I[4] + I[5] + I[6] },
      fix = fix,
      reference = { [U[1]] = 0.0406670821645, [U[2]] = -0.0218272241667, [U[3]] = 0.3352245573,
        [I[3]] = -0.00606203140067 },
    }
  end,
}

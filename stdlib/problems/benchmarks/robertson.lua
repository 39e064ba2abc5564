return {
  title = "Robertson's reaction as a DAE",
  source = [[Robertson 1966; Hairer & Wanner, Solving ODEs II, 2nd ed., §IV.1; references in quadruple
    precision]],
  statement = [[Three species, rates from 0.04 to 3·10⁷, the total amount as algebraic equation. The time
    spans ten decades.]],
  tags = "chemistry nonlinear benchmark",
  index = 1, dof = 2, structural_index = 1, structural_dof = 2, verdict = "valid",
  to = 40,
  build = function()
    local y1, y2, y3 = vars "y1 y2 y3"
    return {
      model = dae { der(y1) ~ -0.04*y1 + 10000*y2*y3, der(y2) ~ 0.04*y1 - 10000*y2*y3 - 30000000*y2^2,
        0 ~ y1 + y2 + y3 - 1,
        name = "Robertson" },
      constraints = {},
      fix = { [y1] = 1, [y2] = 0 },
      reference = { [y1] = 0.71582706872, [y2] = 9.1855347646e-6, [y3] = 0.28416374575 },
      references = {
        [4e7] = { [y1] = 5.2030718441205470e-5, [y2] = 2.0813357318925326e-10, [y3] = 0.99994796907342522 },
        [4e10] = { [y1] = 5.2083451767992389e-8, [y2] = 2.0833381779254889e-13, [y3] = 0.99999994791632990 },
      },
    }
  end,
}

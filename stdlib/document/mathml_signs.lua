-- What the commands of LaTeX mean as signs: letters, operators, functions, accents, spaces, alphabets.
local M = {}

M.greek = {}
for name, letter in ([[alpha α beta β gamma γ delta δ epsilon ϵ varepsilon ε zeta ζ eta η theta θ vartheta ϑ
    iota ι kappa κ lambda λ mu μ nu ν xi ξ omicron ο pi π varpi ϖ rho ρ varrho ϱ sigma σ varsigma ς tau τ
    upsilon υ phi ϕ varphi φ chi χ psi ψ omega ω Gamma Γ Delta Δ Theta Θ Lambda Λ Xi Ξ Pi Π Sigma Σ
    Upsilon Υ Phi Φ Psi Ψ Omega Ω]]):gmatch "(%S+)%s+(%S+)" do
  M.greek[name] = letter
end

M.operators = {}
for name, sign in ([[cdot ⋅ times × div ÷ pm ± mp ∓ le ≤ leq ≤ ge ≥ geq ≥ ne ≠ neq ≠ approx ≈ equiv ≡ sim ∼
    ll ≪ gg ≫ to → rightarrow → leftarrow ← Rightarrow ⇒ Leftrightarrow ⇔ mapsto ↦ in ∈ notin ∉ subset ⊂ cup ∪
    cap ∩ land ∧ lor ∨ neg ¬ forall ∀ exists ∃ circ ∘ ast ∗ star ⋆ mid ∣ parallel ∥ perp ⊥ propto ∝ prime ′
    setminus ∖ langle ⟨ rangle ⟩ lbrace { rbrace } lfloor ⌊ rfloor ⌋ lceil ⌈ rceil ⌉ vert | Vert ‖ | ‖ { { } }
    colon :]]):gmatch "(%S+)%s+(%S+)" do
  M.operators[name] = sign
end

M.identifiers = { infty = "∞", partial = "∂", nabla = "∇", top = "⊤", ell = "ℓ", hbar = "ℏ",
  emptyset = "∅", Re = "ℜ", Im = "ℑ", dots = "…", ldots = "…", cdots = "⋯", vdots = "⋮", ddots = "⋱",
  imath = "ı", jmath = "ȷ", ["%"] = "%", ["#"] = "#", ["_"] = "_", ["&"] = "&", ["$"] = "$" }

M.functions = {}
for name in ("sin cos tan arcsin arccos arctan sinh cosh tanh exp ln log det dim ker rank arg gcd")
    :gmatch "%S+" do
  M.functions[name] = true
end

M.large = { sum = "∑", prod = "∏", lim = "lim", max = "max", min = "min", sup = "sup", inf = "inf" }
M.integrals = { int = "∫", iint = "∬", oint = "∮" }
M.accents = { dot = "˙", ddot = "¨", dddot = "⃛", hat = "^", widehat = "^", bar = "¯", overline = "¯",
  vec = "→", tilde = "~", widetilde = "~" }
M.spaces = { quad = "1em", qquad = "2em", [","] = "0.17em", [":"] = "0.22em", [";"] = "0.28em",
  ["!"] = "-0.17em", [" "] = "0.33em" }
M.sized = { big = true, Big = true, bigg = true, Bigg = true, bigl = true, bigr = true, Bigl = true,
  Bigr = true, displaystyle = true, textstyle = true, limits = true, nolimits = true, nonumber = true,
  notag = true, hline = true }

-- First code point of the alphabets, for A … Z, a … z, α … ω and 0 … 9. MathML has no other bold letters.
M.alphabets = {
  mathbf = { upper = 0x1D400, lower = 0x1D41A, Upper = 0x1D6A8, greek = 0x1D6C2, digit = 0x1D7CE },
  boldsymbol = { upper = 0x1D468, lower = 0x1D482, Upper = 0x1D71C, greek = 0x1D736, digit = 0x1D7CE },
  mathbb = { upper = 0x1D538, C = 0x2102, H = 0x210D, N = 0x2115, P = 0x2119, Q = 0x211A, R = 0x211D,
    Z = 0x2124 },
  mathcal = { upper = 0x1D49C, B = 0x212C, E = 0x2130, F = 0x2131, H = 0x210B, I = 0x2110, L = 0x2112,
    M = 0x2133, R = 0x211B },
}
M.alphabets.bm, M.alphabets.textbf = M.alphabets.boldsymbol, M.alphabets.mathbf

-- Letters as they are in an alphabet; what it does not have stays.
function M.in_alphabet(letters, alphabet)
  local out = {}
  for _, code in utf8.codes(letters) do
    local c = utf8.char(code)
    local first, base
    if alphabet[c] then first, base = alphabet[c], code
    elseif c:find "^%u$" then first, base = alphabet.upper, 65
    elseif c:find "^%l$" then first, base = alphabet.lower, 97
    elseif c:find "^%d$" then first, base = alphabet.digit, 48
    elseif code >= 0x391 and code <= 0x3A9 then first, base = alphabet.Upper, 0x391
    elseif code >= 0x3B1 and code <= 0x3C9 then first, base = alphabet.greek, 0x3B1 end
    out[#out + 1] = first and utf8.char(first + code - base) or c
  end
  return table.concat(out)
end

return M

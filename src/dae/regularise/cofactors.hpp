// c = Σ aⱼ Cⱼ with polynomials aⱼ: the proof that c vanishes wherever all Cⱼ do.
#pragma once

#include <optional>
#include <string>
#include <vector>

#include "expr/graph/graph.hpp"

namespace pendula::dae {

/// The aⱼ of lowest degree, polynomials over ℚ in the symbols of c and C and in their sines,
/// exponentials …, for which the identity holds. Nothing where there are none that are short; they may
/// exist. Found by linear algebra on residues at random points, proved by generic::is_zero. Cost: cubic
/// in the number of monomials tried, at most 240.
std::optional<std::vector<Expr>> cofactors(Expr c, const std::vector<Expr>& C);

/// "C₁ - q₃ C₂": Σ aⱼ times the names of Cⱼ.
std::string combination_text(const std::vector<Expr>& a, const std::vector<std::string>& names);

}  // namespace pendula::dae

// The classes of models that textbooks distinguish, and the conversions between them.
#pragma once

#include "dae/model/model.hpp"

namespace pendula::dae {

/// x′ = f, 0 = g.  F(x′, x, z, u) = 0.  E x′ = A x + B u (x may be empty: made as var("x", n)).
ModelPtr semi_explicit(const VecX& x, const VecX& z, const VecX& u, const VecX& f, const VecX& g,
                       std::string name = "");
ModelPtr implicit(const VecX& x, const VecX& z, const VecX& u, const VecX& F, std::string name = "");
ModelPtr linear(const MatX& E, const MatX& A, const MatX& B, VecX x, VecX u, std::string name = "");

/// Conversions between the classes of Brenan, Campbell & Petzold §1.2. Semi-explicit: solved equations stay,
/// otherwise x′ = δ with new algebraic δ.
ModelPtr to_semi_explicit(const ModelPtr& model);
ModelPtr to_implicit(const ModelPtr& model);
/// Variables of order > 1 get their derivatives as new variables: q″ = f becomes q′ = v, v′ = f.
ModelPtr to_first_order(const ModelPtr& model);

}  // namespace pendula::dae

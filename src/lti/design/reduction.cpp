#include "lti/design/reduction.hpp"

#include <cmath>
#include <optional>

#include "base/decompositions.hpp"
#include "base/error.hpp"
#include "base/text.hpp"
#include "lti/structure.hpp"

namespace pendula::lti {
namespace {

/// L with L Lᵀ = P for a positive semidefinite P; rounding errors are judged relative to each diagonal entry,
/// independent of units.
Mat root(const Mat& P) {
  const Vec size = P.diagonal().unaryExpr(
      [](double p) { return p > 0 ? std::exp2(std::round(0.5 * std::log2(p))) : 1.0; });
  const Vec inverse = size.cwiseInverse();
  const Eigen::SelfAdjointEigenSolver<Mat> eigen(Mat(inverse.asDiagonal() * P * inverse.asDiagonal()));
  return size.asDiagonal() * eigen.eigenvectors() *
         eigen.eigenvalues().cwiseMax(0.0).cwiseSqrt().asDiagonal();
}

struct Projection {
  Mat T, back;  ///< x ≈ T x̃, x̃ = back x
  Vec hankel;   ///< all Hankel singular values
};

Projection projection(const System& g, std::optional<Index> order = {}) {
  if (g.ss.order() == 0) throw Error("the system has no states");
  const Mat Lc = root(numbers(gramian(g, true))), Lo = root(numbers(gramian(g, false)));
  const Eigen::JacobiSVD<Mat> svd(Lo.transpose() * Lc, Eigen::ComputeFullU | Eigen::ComputeFullV);
  const Vec sigma = svd.singularValues();
  // 450 ε; states below it are uncontrollable or unobservable but for rounding
  constexpr double rounding = 1e-13;
  const auto numerical = static_cast<Index>((sigma.array() > rounding * sigma[0]).count());
  const Index kept = order ? std::min(*order, numerical) : numerical;
  const Vec scale = sigma.head(kept).cwiseSqrt().cwiseInverse();
  return {Lc * svd.matrixV().leftCols(kept) * scale.asDiagonal(),
          scale.asDiagonal() * svd.matrixU().leftCols(kept).transpose() * Lo.transpose(), sigma};
}

System transformed(const System& g, const Projection& p) {
  const Mat A = p.back * numbers(g.ss.A) * p.T, B = p.back * numbers(g.ss.B), C = numbers(g.ss.C) * p.T;
  System h = make_ss(expressions(A), expressions(B), expressions(C), g.ss.D, g.Ts);
  h.input_names = g.input_names;
  h.output_names = g.output_names;
  return h;
}

/// x̃₂′ = 0 (or x̃₂⁺ = x̃₂) solved for x̃₂.
System residualised(const System& g, Index kept) {
  const Mat A = numbers(g.ss.A), B = numbers(g.ss.B), C = numbers(g.ss.C), D = numbers(g.ss.D);
  const Index rest = A.rows() - kept;
  Mat still = -A.bottomRightCorner(rest, rest);
  if (!g.continuous()) still += Mat::Identity(rest, rest);
  const Eigen::PartialPivLU<Mat> lu(still);
  const Mat to_state = lu.solve(Mat(A.bottomLeftCorner(rest, kept))),
            to_input = lu.solve(Mat(B.bottomRows(rest)));
  const Mat A12 = A.topRightCorner(kept, rest), C2 = C.rightCols(rest);
  System h = make_ss(expressions(A.topLeftCorner(kept, kept) + A12 * to_state),
                     expressions(B.topRows(kept) + A12 * to_input),
                     expressions(C.leftCols(kept) + C2 * to_state), expressions(D + C2 * to_input), g.Ts);
  h.input_names = g.input_names;
  h.output_names = g.output_names;
  return h;
}

}  // namespace

Balanced balanced(const System& given) {
  const System g = to_ss(with_numbers(given));
  if (g.ss.order() == 0) throw Error("the system has no states");
  const Projection p = projection(g);
  if (p.T.cols() < g.ss.order())
    throw Error(text("a balanced realisation needs a minimal system, but only ", p.T.cols(), " of ",
                     g.ss.order(), " states are both controllable and observable: minreal(G) first"));
  return {transformed(g, p), p.hankel, p.T};
}

Reduction reduced(const System& given, int order, const std::string& method) {
  const System g = to_ss(with_numbers(given));
  if (order < 0 || order > g.ss.order())
    throw Error(text("order must lie between 0 and ", g.ss.order(), ", the number of states, got ", order));
  if (method != "truncate" && method != "dc")
    throw Error(text("unknown method '", method, "' (methods: truncate, dc)"));
  const Projection p = projection(g, method == "truncate" ? std::optional<Index>(order) : std::nullopt);
  Reduction out{transformed(g, p), p.hankel, 0};
  if (method == "dc" && out.system.ss.order() > order) out.system = residualised(out.system, order);
  out.bound = 2 * p.hankel.tail(p.hankel.size() - order).sum();
  return out;
}

}  // namespace pendula::lti

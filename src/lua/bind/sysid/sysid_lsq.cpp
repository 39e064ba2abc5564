// lsq: linear least squares with weights or a covariance. Reads arguments, calls
// src/sysid/regression/least_squares.
#include "base/counted.hpp"
#include "base/text.hpp"
#include "lua/bind/sysid/sysid.hpp"

namespace pendula::lua {

using Eigen::Index;

struct LsqResult {
  sysid::WeightedLeastSquares fit;
  std::vector<std::string> names;
  std::string noise;  ///< for maximum likelihood: the density in words
  double log_likelihood = 0;
};
template <>
struct TypeName<LsqResult> {
  static constexpr const char* value = "lsq_result";
};

namespace {

/// noise = a density: the parameter set for uniform noise, or the maximum-likelihood estimate instead
/// of least squares.
int with_density(Call& call, LsqResult result, const Mat& A, const Vec& y, const sysid::Density& noise) {
  if (A.rows() != y.size())
    throw Error(text("A has ", counted(A.rows(), "row"), " but y has ", counted(y.size(), "entry")));
  sysid::Regression r{A, y, result.names, {}};
  for (Index i = 1; i <= y.size(); ++i) r.sample.push_back(i);
  if (noise.kind == sysid::Density::Kind::uniform) return push_parameter_set(call, std::move(r), noise);
  result.fit = sysid::least_squares(A, y, {});
  if (result.fit.rank == A.cols()) {  // otherwise the rank is reported first
    const sysid::LikelihoodFit best = sysid::maximise(r, noise);
    result.fit.theta = best.theta;
    result.fit.covariance = best.covariance;
    result.fit.residuals = y - A * best.theta;
    result.fit.sse = result.fit.residuals.squaredNorm();
    result.noise = sysid::described(noise, best);
    result.log_likelihood = best.log_likelihood;
  }
  return call.push(std::make_shared<const LsqResult>(std::move(result)));
}

int lsq(Call& call) {
  lua_State* L = call.L;
  const Mat A = to_data(L, 1, "A");
  const Vec y = to_data(L, 2, "y").reshaped();
  const Options o = call.options(3);
  if (o.has("covariance") && o.has("weights"))
    throw Error("give covariance or weights, not both (weights = 1/variance)");
  // a list of n numbers is a column, but with a single observation it is a row
  const Mat rows = A.cols() == 1 && y.size() == 1 ? Mat(A.transpose()) : A;
  sysid::Weighting weighting;
  if (o.has("covariance")) weighting.covariance = to_data(L, o.push("covariance"), "covariance");
  if (weighting.covariance.size() == 1 && y.size() > 1)  // a common variance
    weighting.covariance = Mat(Mat::Constant(y.size(), 1, weighting.covariance(0, 0)));
  if (o.has("weights")) weighting.weights = to_data(L, o.push("weights"), "weights").reshaped();
  LsqResult result;
  if (o.has("names")) {
    result.names = to_words(L, o.push("names"), "names");
    if (static_cast<Index>(result.names.size()) != rows.cols())
      throw Error(text("names: expected ", rows.cols(), ", one per column of A, got ", result.names.size()));
  } else {
    for (Index i = 1; i <= rows.cols(); ++i) result.names.push_back("θ" + subscript(static_cast<long>(i)));
  }
  lua_settop(L, call.count());
  if (const auto noise = read_noise(call, o)) {
    if (o.has("covariance") || o.has("weights"))
      throw Error("give noise or covariance or weights, not several of them");
    return with_density(call, std::move(result), rows, y, *noise);
  }
  result.fit = sysid::least_squares(rows, y, weighting);
  return call.push(std::make_shared<const LsqResult>(std::move(result)));
}

const LsqResult& result_of(Call& call) { return call.object<LsqResult>(1, "lsq_result"); }
int lsq_theta(Call& call) { return push_matrix(call.L, Mat(result_of(call).fit.theta)); }
int covariance(Call& call) {
  if (result_of(call).fit.covariance.size() == 0)
    throw Error("this estimate has no covariance: it lies in a corner of the feasible set");
  return push_matrix(call.L, result_of(call).fit.covariance);
}
int lsq_deviations(Call& call) {
  if (result_of(call).fit.covariance.size() == 0)
    throw Error("this estimate has no standard deviation: it lies in a corner of the feasible set");
  return push_matrix(call.L,
                     Mat(sysid::standard_deviations(result_of(call).fit, result_of(call).fit.covariance)));
}
int lsq_rank(Call& call) { return call.push(static_cast<long>(result_of(call).fit.rank)); }
int lsq_sigma2(Call& call) { return call.push(result_of(call).fit.sigma2); }
int sse(Call& call) { return call.push(result_of(call).fit.sse); }
int lsq_residuals(Call& call) { return push_matrix(call.L, Mat(result_of(call).fit.residuals)); }
int null_space(Call& call) { return push_matrix(call.L, result_of(call).fit.null_space); }
int lsq_exact(Call& call) { return call.push(result_of(call).fit.exact()); }
int lsq_unidentifiable(Call& call) {
  return push_words(call.L, sysid::free_directions(result_of(call).fit.null_space, result_of(call).names));
}

int lsq_log_likelihood(Call& call) { return call.push(result_of(call).log_likelihood); }

int lsq_text(Call& call) {
  const auto& fit = result_of(call).fit;
  const auto& names = result_of(call).names;
  const bool corner = fit.covariance.size() == 0, likelihood = !result_of(call).noise.empty();
  const Vec std = corner ? Vec(Vec::Zero(fit.theta.size())) : sysid::standard_deviations(fit, fit.covariance);
  const bool uncertain = !corner && (fit.known_noise || fit.sigma2 > 0);
  std::string out = text(likelihood ? "maximum likelihood: " : "least squares: ", fit.rows,
                         fit.rows == 1 ? " row, " : " rows, ", names.size(),
                         names.size() == 1 ? " parameter, rank " : " parameters, rank ", fit.rank, "\n");
  Table table({false, true, false});
  for (std::size_t i = 0; i < names.size(); ++i) {
    const auto k = static_cast<Index>(i);
    table.row({names[i], rounded(fit.theta[k]),
               !fit.identifiable(k) ? "not identifiable"
               : uncertain          ? "± " + rounded(std[k], 4)
                                    : ""});
  }
  out += table.str(2);
  if (likelihood)
    out += text("  ", result_of(call).noise, ", ln L = ", rounded(result_of(call).log_likelihood, 7), "\n");
  else if (fit.known_noise)
    out += text("  covariance (Aᵀ S⁻¹ A)⁻¹ with the given S\n");
  else if (fit.exact())
    out += "  the data are reproduced exactly (to rounding)\n";
  else if (fit.sigma2 > 0)
    out += text("  covariance σ² (AᵀA)⁻¹ with σ² = SSE/(rows - rank) = ", rounded(fit.sigma2), "\n");
  else
    out += "  as many rows as parameters: the noise cannot be estimated\n";
  if (fit.null_space.cols() > 0) out += "  the estimate shown is the one of minimum norm\n";
  for (const std::string& line : sysid::free_directions(fit.null_space, names)) out += "    " + line + "\n";
  out.pop_back();
  return call.push(out);
}

const OptionTable lsq_options = {
    {"covariance", "matrix", "", "S, that of the noise"},
    {"weights", "list", "", "1/variances of the rows, up to a common factor"},
    {"names", "string or list", "", "of the parameters, for printing"},
    {"noise", "density or function", "", "maximum likelihood for it; uniform(low, high) gives the set"},
};

}  // namespace

extern const Module lsq_module = {
    "identification",
    "",
    {
        {"lsq", lsq, "lsq(A, y [, { covariance = S | weights = w | noise =, names = {…} }]) -> lsq_result",
         R"(θ that minimises (Aθ - y)ᵀ S⁻¹ (Aθ - y). With S, the covariance of the noise, cov θ = (Aᵀ S⁻¹
            A)⁻¹; without it, σ̂² (AᵀA)⁻¹; weights are 1/variances up to a common factor. noise: maximum
            likelihood for a density; uniform(low, high) gives the set. When the rank is deficient the
            estimate has minimum norm and the result says which combinations are free.)",
         R"(print(lsq({ {0, 1} }, {1}, { names = {"a", "b"} })))",
         R"(
            least squares: 1 row, 2 parameters, rank 1
              a  0  not identifiable
              b  1
              the data are reproduced exactly (to rounding)
              the estimate shown is the one of minimum norm
                a is not identifiable)",
         &lsq_options},
        {"lsq_result#theta", lsq_theta, "r.theta -> column", "The estimate.", "", ""},
        {"lsq_result#covariance", covariance, "r.covariance -> matrix", "Its covariance.", "", ""},
        {"lsq_result#cov", covariance, "r.cov -> matrix", "Its covariance.", "", ""},
        {"lsq_result#std", lsq_deviations, "r.std -> column",
         "Standard deviations; inf where not identifiable.", "", ""},
        {"lsq_result#rank", lsq_rank, "r.rank -> integer", "The rank of A.", "", ""},
        {"lsq_result#sigma2", lsq_sigma2, "r.sigma2 -> number", "SSE/(rows - rank), in units of the weights.",
         "", ""},
        {"lsq_result#sse", sse, "r.sse -> number", "The weighted sum of squares.", "", ""},
        {"lsq_result#residuals", lsq_residuals, "r.residuals -> column", "y - Aθ.", "", ""},
        {"lsq_result#null_space", null_space, "r.null_space -> matrix",
         "θ + null_space α predicts the same for every α.", "", ""},
        {"lsq_result#exact", lsq_exact, "r.exact -> boolean", "The residual is rounding.", "", ""},
        {"lsq_result#log_likelihood", lsq_log_likelihood, "r.log_likelihood -> number",
         "With noise = …: ln L at θ.", "", ""},
        {"lsq_result#unidentifiable", lsq_unidentifiable, "r.unidentifiable -> list",
         "The free combinations in words; empty at full rank.", "", ""},
        {"lsq_result:__tostring", lsq_text, "print(r)",
         "Estimate ± standard deviation, rank and free combinations.", "", ""},
    }};

}  // namespace pendula::lua

// quantile, histogram and other statistics of a list of numbers. Reads arguments, calls src/random.
#include "random/data.hpp"

#include <algorithm>
#include <cmath>

#include "base/text.hpp"
#include "lua/bind/random/random.hpp"

namespace pendula::lua {
namespace {

std::vector<double> sample_of(Call& call, int i) {
  const Mat values = to_numeric_matrix(call.L, i, "data");
  std::vector<double> sorted =
      random::sorted_sample({values.data(), static_cast<std::size_t>(values.size())});
  if (sorted.empty()) throw Error("there are no data, or all of them are nan");
  return sorted;
}

/// The sample, for functions that divide its range.
std::vector<double> finite_sample_of(Call& call, int i) {
  std::vector<double> sorted = sample_of(call, i);
  if (!std::isfinite(sorted.front()) || !std::isfinite(sorted.back()))
    throw Error("the data contain an infinite value; leave it out");
  return sorted;
}

int sample_quantile_of(Call& call) {
  const std::vector<double> sorted = sample_of(call, 1);
  const bool one = lua_type(call.L, 2) == LUA_TNUMBER;
  Mat p = one ? Mat::Constant(1, 1, call.number(2, "p")) : to_numeric_matrix(call.L, 2, "p");
  for (double& v : p.reshaped()) {
    if (!(v >= 0 && v <= 1)) throw Error(text("p = ", shortest(v), "; a probability lies between 0 and 1"));
    v = random::sample_quantile(sorted, v);
  }
  return one ? call.push(p(0, 0)) : push_matrix(call.L, p);
}

void set_column(lua_State* L, const char* key, const std::vector<double>& values) {
  push_matrix(L, Mat(Eigen::Map<const Vec>(values.data(), static_cast<Eigen::Index>(values.size()))));
  lua_setfield(L, -2, key);
}

int bin(Call& call) {
  const long bins = call.integer(2, "bins", 0);
  if (bins < 0 || bins > 1'000'000 || (call.has(2) && bins == 0))
    throw Error(text("bins = ", bins, "; it must lie between 1 and 1 000 000"));
  const random::Histogram h = random::histogram(finite_sample_of(call, 1), static_cast<int>(bins));
  lua_createtable(call.L, 0, 2);
  set_column(call.L, "edges", h.edges);
  set_column(call.L, "counts", {h.counts.begin(), h.counts.end()});
  return 1;
}

int smooth_density(Call& call) {
  const std::vector<double> sorted = finite_sample_of(call, 1);
  double bandwidth = call.number(3, "bandwidth", 0);
  if (call.has(3) && !(bandwidth > 0))
    throw Error(text("bandwidth = ", shortest(bandwidth), "; it must be positive"));
  std::vector<double> x;
  if (call.has(2)) {
    const Vec given = to_numbers(call.L, 2, "x");
    x.assign(given.begin(), given.end());
  } else {
    random::kernel_density(sorted, {}, bandwidth);  // chooses the bandwidth
    const double low = sorted.front() - 3 * bandwidth, high = sorted.back() + 3 * bandwidth;
    constexpr int points = 200;
    for (int k = 0; k <= points; ++k) x.push_back(low + (high - low) * k / points);
  }
  const std::vector<double> f = random::kernel_density(sorted, x, bandwidth);
  lua_createtable(call.L, 0, 3);
  set_column(call.L, "x", x);
  set_column(call.L, "f", f);
  lua_pushnumber(call.L, bandwidth);
  lua_setfield(call.L, -2, "bandwidth");
  return 1;
}

int interval(Call& call) {
  const long k = call.integer(1, "k"), n = call.integer(2, "n");
  const Options o = call.options(3);
  const double confidence = o.number("confidence", 0.95);
  const std::string method = o.string("method", "wilson");
  if (n < 1 || k < 0 || k > n)
    throw Error(text(k, " of ", n, " is not a proportion; expected 0 ≤ k ≤ n with n ≥ 1"));
  if (!(confidence > 0 && confidence < 1))
    throw Error(text("confidence = ", shortest(confidence), "; it must lie between 0 and 1"));
  if (method != "wilson" && method != "clopper-pearson")
    throw Error(text("method = '", method, "'; known are \"wilson\" and \"clopper-pearson\".",
                     did_you_mean(method, {"wilson", "clopper-pearson"})));
  const auto [low, high] =
      method == "wilson" ? random::wilson(k, n, confidence) : random::clopper_pearson(k, n, confidence);
  call.push(low);
  return call.push(high) + 1;
}

/// The statistics D and p of a sample against a distribution.
int goodness(Call& call) {
  const std::vector<double> sorted = sample_of(call, 1);
  const auto d = distribution_at(call.L, 2);
  if (!d) throw Error("expected a distribution second, such as normal(0, 1)");
  std::vector<double> F;
  for (double x : sorted) F.push_back(d->cdf(x));
  const double D = random::kolmogorov_smirnov(F);
  call.push(D);
  return call.push(random::kolmogorov_smirnov_p(D, static_cast<long>(sorted.size()))) + 1;
}

const OptionTable interval_options = {
    {"confidence", "number", "0.95", "how often the interval holds the probability"},
    {"method", "string", "", "how it is found", "wilson|clopper-pearson"},
};

}  // namespace

extern const Module samples_module = {
    "random",
    "",
    {
        {"quantile", sample_quantile_of, "quantile(data, p) -> number or matrix",
         R"(The value below which the share p of the data lies, linear between them; p may be a list. nan
            does not count.)",
         "print(quantile({1, 2, 3, 4}, 0.5), quantile({1, 2, 3, 4}, {0, 1}).T)", "2.5 1  4"},
        {"bin", bin, "bin(data [, bins]) -> { edges =, counts = }",
         R"(Counts the data in cells of one width; without a number of cells it follows from the quartiles
            (Freedman & Diaconis). histogram draws them.)",
         "print(bin({1, 2, 2, 3}, 2).counts.T)", "1  3"},
        {"smooth_density", smooth_density,
         "smooth_density(data [, x [, bandwidth]]) -> { x =, f =, bandwidth = }",
         R"(The density of the data at the points x (or 201 points around them) by Gaussian kernels; the bandwidth is
            Silverman's unless it is given.)",
         "print((\"%.4f\"):format(smooth_density({0}, {0}, 1).f[1]))", "0.3989"},
        {"share_interval", interval, "share_interval(k, n [, { confidence = 0.95, method = }]) -> low, high",
         R"(An interval for a probability of which k of n trials were successes: "wilson" or "clopper-pearson" (exact,
            never too short).)",
         "print((\"%.6f %.6f\"):format(share_interval(3, 20)))", "0.052369 0.360419", &interval_options},
        {"ks_test", goodness, "ks_test(data, distribution) -> D, p",
         R"(Kolmogorov–Smirnov: the largest distance between the shares of the data and the distribution function,
            and how likely a larger one is if the data come from it.)",
         "D, p = ks_test({0.1, 0.35, 0.6, 0.85}, uniform(0, 1))\nprint((\"%.2f %.3f\"):format(D, p))",
         "0.15 1.000"},
    }};

}  // namespace pendula::lua

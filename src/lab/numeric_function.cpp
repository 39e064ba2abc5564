#include "lab/numeric_function.hpp"

#include <algorithm>
#include <cmath>
#include <limits>
#include <memory>

#include "base/decompositions.hpp"
#include "base/error.hpp"
#include "base/text.hpp"
#include "codegen/kernel/kernel.hpp"
#include "expr/graph/derivative.hpp"
#include "expr/print/print.hpp"

namespace pendula::lab {
namespace {

using Eigen::Index;
using Values = std::unordered_map<Expr, double>;

/// Leaves, the values of those that are not unknowns, and storage for all values.
struct Arguments {
  std::vector<Expr> leaves;
  std::vector<double> values;

  Arguments(std::vector<Expr> x, std::span<const Expr> outputs, const Values& known) : leaves(std::move(x)) {
    values.assign(leaves.size(), 0);
    for (Expr leaf : pendula::leaves(outputs)) {
      if (symbol_of(leaf).kind == Kind::constant) continue;
      if (std::find(leaves.begin(), leaves.end(), leaf) != leaves.end()) continue;
      const auto it = known.find(leaf);
      if (it == known.end()) {
        const std::string name = symbol_of(leaf).name;
        throw Error(text("'", name,
                         "' is not among the unknowns x and has no value; list it in x or give params = { ",
                         name, " = … }"));
      }
      leaves.push_back(leaf);
      values.push_back(it->second);
    }
  }
};

/// A kernel with its arguments; copies share it.
struct Compiled {
  Arguments arguments;
  codegen::Kernel kernel;
  Compiled(std::vector<Expr> outputs, std::vector<Expr> x, const Values& known)
      : arguments(std::move(x), outputs, known), kernel(outputs, arguments.leaves) {}
  void run(const Vec& x, double* out) {
    std::copy(x.begin(), x.end(), arguments.values.begin());
    kernel(arguments.values.data(), out);
  }
};

/// Second derivatives of Σ wᵢ rᵢ with the weights as arguments.
struct Curvature {
  std::vector<Expr> r, x;
  Values known;
  std::shared_ptr<Compiled> compiled;

  void run(const Vec& at, const Vec& w, Mat& S) {
    if (!compiled) compile_now();
    Vec both(at.size() + w.size());
    both << at, w;
    S.resize(at.size(), at.size());
    compiled->run(both, S.data());
  }
  void compile_now() {
    std::vector<Expr> both = x, second;
    Expr sum;
    for (std::size_t i = 0; i < r.size(); ++i) {
      const Expr w = symbol(Kind::slot, "weight" + std::to_string(i + 1));
      both.push_back(w);
      sum += w * r[i];
    }
    const MatX H = pendula::jacobian(gradient(sum, x), x);
    second.assign(H.data(), H.data() + H.size());
    compiled = std::make_shared<Compiled>(second, both, known);
  }
};

std::string culprit(const std::vector<Expr>& r, const Arguments& arguments, const Vec& x) {
  Values point;
  for (std::size_t j = 0; j < arguments.leaves.size(); ++j)
    point[arguments.leaves[j]] = j < static_cast<std::size_t>(x.size()) ? x[j] : arguments.values[j];
  for (std::size_t i = 0; i < r.size(); ++i)
    if (const auto node = first_undefined(r[i], point)) {
      std::vector<std::string> where;
      for (Expr leaf : leaves({&*node, 1}))
        if (point.count(leaf) && where.size() < 4)
          where.push_back(text(to_text(leaf), " = ", rounded(point[leaf], 6)));
      return text("equation ", i + 1, ": '", to_text(*node), "' has no finite value",
                  where.empty() ? "" : " at ", join(where, ", "));
    }
  return "";
}

}  // namespace

NumericFunction compile(std::vector<Expr> r, std::vector<Expr> x, const Values& values) {
  NumericFunction f;
  for (Expr leaf : x) f.unknowns.push_back(to_text(leaf));
  f.outputs = static_cast<int>(r.size());
  const auto value = std::make_shared<Compiled>(r, x, values);
  f.value = [value](const Vec& at, Vec& out) { value->run(at, out.data()); };
  const MatX J = pendula::jacobian(r, x);
  f.jacobian = compile_matrix({J.data(), J.data() + J.size()}, x, values);
  const auto curvature = std::make_shared<Curvature>(Curvature{r, x, values, nullptr});
  f.curvature = [curvature](const Vec& at, const Vec& w, Mat& S) { curvature->run(at, w, S); };
  f.undefined = [value, r](const Vec& at) { return culprit(r, value->arguments, at); };
  return f;
}

std::function<void(const Vec&, Mat&)> compile_matrix(std::vector<Expr> columns, std::vector<Expr> x,
                                                     const Values& values) {
  const auto compiled = std::make_shared<Compiled>(std::move(columns), std::move(x), values);
  return [compiled](const Vec& at, Mat& J) { compiled->run(at, J.data()); };
}

void difference_jacobian(const NumericFunction& f, const Vec& x, const Vec& r, double h, Mat& J) {
  if (h == 0) h = std::sqrt(eps);
  Vec moved = x, changed(r.size());
  for (Index j = 0; j < x.size(); ++j) {
    moved[j] = x[j] + h * std::max(std::fabs(x[j]), 1.0);
    f.value(moved, changed);
    J.col(j) = (changed - r) / (moved[j] - x[j]);
    moved[j] = x[j];
  }
}

std::string direction_text(const std::vector<std::string>& names, Vec v) {
  const double largest = v.size() ? v.cwiseAbs().maxCoeff() : 0;
  if (!(largest > 0) || !std::isfinite(largest)) return "no direction";
  std::vector<std::string> who, components;
  for (Index j = 0; j < v.size(); ++j) {
    if (std::fabs(v[j]) < no_component * largest) continue;
    who.push_back(names[j]);
    components.push_back(rounded(v[j], 4));
  }
  if (who.size() == 1) return text("the direction of ", who[0]);
  return text("(", join(who, ", "), ") ∝ (", join(components, ", "), ")");
}

std::string wrapped(const std::string& words, int columns) {
  std::string out;
  int used = 0;
  for (std::size_t at = 0; at < words.size();) {
    const std::size_t end = std::min(words.find(' ', at), words.size());
    const std::string word = words.substr(at, end - at);
    const int width = display_width(word);
    if (used > 0 && used + 1 + width > columns) {
      out += "\n" + word;
      used = width;
    } else {
      out += (used > 0 ? " " : "") + word;
      used += width + (used > 0 ? 1 : 0);
    }
    at = end + 1;
  }
  return out;
}

std::string condition_text(double condition) {
  if (!std::isfinite(condition)) return "infinite";
  constexpr double small = 1000;  // exact ones of small matrices are read as numbers, others as powers of ten
  return condition < small ? rounded(condition, 2) : rounded(condition, 1);
}

double Conditioning::condition() const {
  return smallest > 0 ? largest / smallest : std::numeric_limits<double>::infinity();
}

Conditioning conditioning(const Mat& J, const Mat& scale) {
  Conditioning result;
  if (J.size() == 0 || !J.allFinite()) return result;
  const Mat size = scale.size() ? Mat(scale.cwiseMax(J.cwiseAbs())) : Mat(J.cwiseAbs());
  Vec row = size.rowwise().lpNorm<Eigen::Infinity>();
  for (double& v : row) v = v > 0 ? 1 / v : 1;
  Vec column = (row.asDiagonal() * size).colwise().lpNorm<Eigen::Infinity>();
  for (double& v : column) v = v > 0 ? 1 / v : 1;
  const Mat scaled = row.asDiagonal() * J * column.asDiagonal();
  const Eigen::JacobiSVD<Mat> svd(scaled, Eigen::ComputeFullU | Eigen::ComputeFullV);
  const Vec& sigma = svd.singularValues();
  result.largest = sigma[0];
  result.smallest = J.rows() < J.cols() ? 0 : sigma[sigma.size() - 1];
  result.null_vector = column.cwiseProduct(svd.matrixV().col(J.cols() - 1));
  result.combination = row.cwiseProduct(svd.matrixU().col(std::min(J.rows(), J.cols()) - 1));
  for (Vec* v : {&result.null_vector, &result.combination}) {
    const double most = v->cwiseAbs().maxCoeff();
    Index at = 0;  // of components of equal size to within rounding, the first one becomes 1
    while (std::fabs((*v)[at]) < (1 - no_component) * most) ++at;
    *v /= (*v)[at];
  }
  return result;
}

}  // namespace pendula::lab

// Linear equations in the sense of least absolute deviations, of one pattern and
// with right sides that change.
#pragma once

#include <Eigen/SparseCholesky>
#include <algorithm>
#include <cmath>
#include <map>
#include <numeric>
#include <vector>

#include "base/math.hpp"

namespace pendula::dae {

/// min Σ weight |equation|, by reweighted least squares; what nothing determines stays at 0. Of one
/// pattern, which is analysed once.
class LeastAbsolute {
 public:
  using Index = Eigen::Index;

  /// Slopes · x = right side; right sides come with every call.
  void add(const std::map<Index, double>& slopes) {
    for (const auto& [j, c] : slopes) {
      column_.push_back(j);
      slope_.push_back(c);
    }
    end_.push_back(column_.size());
  }
  /// After the last equation.
  void finish(Index unknowns) {
    n_ = unknowns;
    lay_out();
  }

  /// One more equation: x_j = value.
  struct Single {
    Index column;
    double value, weight;
  };

  Vec operator()(const std::vector<double>& right_sides, const std::vector<Single>& singles) {
    constexpr int sweeps = 5;
    Vec x = Vec::Zero(n_);
    for (int sweep = 0; sweep < sweeps; ++sweep) {
      accumulate(x, right_sides, singles, sweep == 0);
      factors_.refactor(N_);
      const Vec next = factors_.solve(right_);
      if (!next.allFinite()) break;
      x = next;
    }
    return x;
  }

 private:
  static constexpr double slight = 1e-12;  ///< holds what is not determined, moves nothing else

  /// Of a matrix whose rows and columns are in the order of elimination, its upper triangle.
  class Factors : public Eigen::SimplicialLDLT<Eigen::SparseMatrix<double>> {
   public:
    void refactor(const Eigen::SparseMatrix<double>& upper) {
      this->template factorize_preordered<true>(upper);
    }
  };

  std::size_t begin(std::size_t row) const { return row == 0 ? 0 : end_[row - 1]; }

  /// The normal equations in the order of elimination, and where each product of two slopes belongs.
  void lay_out() {
    std::vector<Eigen::Triplet<double>> entries;
    for (Index j = 0; j < n_; ++j) entries.emplace_back(j, j, 1);
    for (std::size_t row = 0; row < end_.size(); ++row)
      for (std::size_t p = begin(row); p < end_[row]; ++p)
        for (std::size_t q = p; q < end_[row]; ++q) entries.emplace_back(column_[q], column_[p], 1);
    Eigen::SparseMatrix<double> lower(n_, n_);
    lower.setFromTriplets(entries.begin(), entries.end());
    factors_.analyzePattern(lower);
    std::iota(lower.valuePtr(), lower.valuePtr() + lower.nonZeros(), 0.0);
    N_.resize(n_, n_);
    N_.selfadjointView<Eigen::Upper>() =
        lower.selfadjointView<Eigen::Lower>().twistedBy(factors_.permutationP());
    std::vector<std::size_t> moved(static_cast<std::size_t>(N_.nonZeros()));
    for (std::size_t k = 0; k < moved.size(); ++k) {
      const auto before = static_cast<std::size_t>(N_.valuePtr()[k]);
      moved[before] = k;
    }
    const auto place_of = [&](Index i, Index j) {
      const std::ptrdiff_t before = &lower.coeffRef(i, j) - lower.valuePtr();
      return moved[before];
    };
    for (Index j = 0; j < n_; ++j) diagonal_.push_back(place_of(j, j));
    for (std::size_t row = 0; row < end_.size(); ++row)
      for (std::size_t p = begin(row); p < end_[row]; ++p)
        for (std::size_t q = p; q < end_[row]; ++q) place_.push_back(place_of(column_[q], column_[p]));
  }

  void accumulate(const Vec& x, const std::vector<double>& right_sides, const std::vector<Single>& singles,
                  bool first) {
    double* const N = N_.valuePtr();
    std::fill_n(N, N_.nonZeros(), 0.0);
    right_ = Vec::Zero(n_);
    constexpr double smooth =
        0.1;  // |off|, in log units, below which its square is minimised: a tenth of a size
    const auto weighed = [&](double weight, double off) {
      return weight / (first ? 1 : smooth + std::fabs(off));
    };
    std::size_t next = 0;
    for (std::size_t row = 0; row < end_.size(); ++row) {
      const double b = right_sides[row];
      double sum = 0;
      for (std::size_t p = begin(row); p < end_[row]; ++p) sum += x[column_[p]] * slope_[p];
      const double w = weighed(1, sum - b);
      for (std::size_t p = begin(row); p < end_[row]; ++p) {
        right_[column_[p]] += slope_[p] * (w * b);
        for (std::size_t q = p; q < end_[row]; ++q) N[place_[next++]] += slope_[q] * (w * slope_[p]);
      }
    }
    for (const Single& s : singles) {
      const double w = weighed(s.weight, x[s.column] - s.value);
      right_[s.column] += w * s.value;
      N[diagonal_[s.column]] += w;
    }
    for (std::size_t place : diagonal_) N[place] += slight;
  }

  Index n_ = 0;
  std::vector<Index> column_;  ///< of the slopes of all equations, one equation after the other
  std::vector<double> slope_;
  std::vector<std::size_t> end_;               ///< by equation
  std::vector<std::size_t> place_, diagonal_;  ///< in N
  Eigen::SparseMatrix<double> N_;
  Factors factors_;
  Vec right_;
};

}  // namespace pendula::dae

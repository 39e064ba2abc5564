// The regressor of an equation-error model, φ(t) = [-y(t-1) … -y(t-na)  u(t-nk) … u(t-nk-nb+1)]ᵀ, so that
// y(t) = φ(t)ᵀθ + e(t) with θ = [a1 … a_na  b_nk …]ᵀ (Ljung, System Identification, 2nd ed., (4.11)–(4.12);
// docs/derivations.md#regression).
#pragma once

#include <string>
#include <vector>

#include "sysid/data/iddata.hpp"

namespace pendula::sysid {

/// Treatment of the start of an experiment, where φ(t) needs samples before the first one: rows left out;
/// those samples taken as zero; or those of y estimated with θ and those of u taken as zero.
enum class InitialCondition { drop, zero, estimate };
InitialCondition initial_condition_named(const std::string& name);

/// Orders as in MATLAB: B_i has nb_i coefficients after a delay of nk_i samples; one entry per input.
struct Orders {
  int na = 0, nc = 0, nd = 0;
  std::vector<int> nb, nk, nf;
  /// Number of samples before t that φ(t) needs: max(na, nb + nk - 1).
  Index memory() const;
  Index parameters() const;
};
/// throws Error on negative orders and on lists whose length is not the number of inputs.
Orders checked(Orders orders, const IdData& d);

/// Rows first..last-1 of the data; samples before `begin` belong to no measurement
/// (or to another experiment).
struct RowRange {
  Index first, last, begin;
};

class Regressor {
 public:
  /// For output `output`. The data must outlive the regressor.
  Regressor(const IdData& data, Index output, Orders orders, InitialCondition start);

  Index columns() const { return static_cast<Index>(names_.size()); }
  const std::vector<std::string>& names() const { return names_; }  ///< a1 a2 b3 b4, b1(u2) …
  const Orders& orders() const { return orders_; }

  /// φ(t) for data row t (0-based); samples before `begin` count as zero.
  void row(Index t, Index begin, double* phi) const;
  /// The usable rows: neither φ(t) nor y(t) miss a value. Ranges do not cross experiments.
  const std::vector<RowRange>& ranges() const { return ranges_; }
  Index rows() const;
  Index left_out() const { return missing_rows_; }  ///< rows left out because a sample is missing
  Mat matrix() const;                               ///< Φ, rows()×columns()
  Vec targets() const;

  /// Lags that follow each other: columns first … first+count-1 hold sign·signal(t - lag - i).
  struct Group {
    const double* signal;
    Index lag, count;
    double sign;
    Index first;
  };
  const std::vector<Group>& groups() const { return groups_; }
  const double* target() const { return target_; }

 private:
  void find_ranges(InitialCondition start);
  const IdData& data_;
  Orders orders_;
  const double* target_;
  std::vector<Group> groups_;
  std::vector<std::string> names_;
  std::vector<RowRange> ranges_;
  Index missing_rows_ = 0;
};

}  // namespace pendula::sysid

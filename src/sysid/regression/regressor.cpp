#include "sysid/regression/regressor.hpp"

#include <cmath>

#include "base/error.hpp"
#include "base/text.hpp"

namespace pendula::sysid {

InitialCondition initial_condition_named(const std::string& name) {
  if (name == "drop") return InitialCondition::drop;
  if (name == "zero") return InitialCondition::zero;
  if (name == "estimate") return InitialCondition::estimate;
  throw Error(
      text("unknown ic '", name, "'.", did_you_mean(name, {"drop", "zero", "estimate"}),
           " (ic = \"drop\": leave out the rows that need earlier samples; \"zero\": these samples are zero; "
           "\"estimate\": they are estimated too)"));
}

Index Orders::memory() const {
  Index m = na;
  for (std::size_t i = 0; i < nb.size(); ++i)
    if (nb[i] > 0) m = std::max<Index>(m, nb[i] + nk[i] - 1);
  return m;
}

Index Orders::parameters() const {
  Index n = na + nc + nd;
  for (const int b : nb) n += b;
  for (const int f : nf) n += f;
  return n;
}

Orders checked(Orders o, const IdData& d) {
  const auto inputs = static_cast<std::size_t>(d.inputs());
  const auto list = [&](std::vector<int>& values, const char* name) {
    if (values.size() == 1 && inputs > 1) values.assign(inputs, values[0]);
    if (values.empty()) values.assign(inputs, 0);
    if (values.size() != inputs) {
      if (inputs == 0) throw Error(text(name, " is given, but the data has no input"));
      throw Error(text(name, " has ", values.size(), values.size() == 1 ? " entry" : " entries",
                       ", but the data has ", inputs, inputs == 1 ? " input" : " inputs"));
    }
  };
  list(o.nb, "nb");
  list(o.nk, "nk");
  list(o.nf, "nf");
  const auto check = [&](int value, const char* name) {
    if (value < 0) throw Error(text(name, " must not be negative, got ", value));
    constexpr int limit = 100000;  // a choice: sums of orders then stay far below 2³¹
    if (value >= limit) throw Error(text(name, " = ", value, " is too large: below ", limit));
  };
  check(o.na, "na");
  check(o.nc, "nc");
  check(o.nd, "nd");
  for (std::size_t i = 0; i < inputs; ++i) {
    check(o.nb[i], "nb");
    check(o.nk[i], "nk");
    check(o.nf[i], "nf");
  }
  if (o.parameters() == 0)
    throw Error("all orders are zero: there is nothing to estimate; give na = 2, nb = 2");
  // the normal equations of 2000 parameters take 32 MB, their factorisation 3·10⁹ operations
  if (o.parameters() > 2000) throw Error(text("the model has ", o.parameters(), " parameters; at most 2000"));
  return o;
}

Regressor::Regressor(const IdData& data, Index output, Orders orders, InitialCondition start)
    : data_(data), orders_(checked(std::move(orders), data)), target_(data.y.col(output).data()) {
  if (orders_.na > 0) groups_.push_back({target_, 1, orders_.na, -1.0, 0});
  for (int i = 1; i <= orders_.na; ++i) names_.push_back("a" + std::to_string(i));
  for (Index k = 0; k < data.inputs(); ++k) {
    const auto i = static_cast<std::size_t>(k);
    if (orders_.nb[i] == 0) continue;
    groups_.push_back({data.u.col(k).data(), orders_.nk[i], orders_.nb[i], 1.0, columns()});
    const std::string of = data.inputs() > 1 ? "(" + data.u_names[i] + ")" : "";
    for (int j = 0; j < orders_.nb[i]; ++j) names_.push_back("b" + std::to_string(orders_.nk[i] + j) + of);
  }
  find_ranges(start);
}

void Regressor::row(Index t, Index begin, double* phi) const {
  for (const Group& g : groups_)
    for (Index i = 0; i < g.count; ++i) {
      const Index s = t - g.lag - i;
      phi[g.first + i] = s < begin ? 0 : g.sign * g.signal[s];
    }
}

void Regressor::find_ranges(InitialCondition start) {
  const Index skip = start == InitialCondition::drop       ? orders_.memory()
                     : start == InitialCondition::estimate ? orders_.na
                                                           : 0;
  const bool complete = missing(data_) == 0;
  std::vector<double> phi(static_cast<std::size_t>(columns()));
  for (Index k = 0; k < data_.experiments(); ++k) {
    const Index begin = data_.starts[k], end = data_.end(k);
    if (complete) {
      if (begin + skip < end) ranges_.push_back({begin + skip, end, begin});
      continue;
    }
    Index first = -1;
    for (Index t = begin + skip; t <= end; ++t) {
      bool usable = t < end && std::isfinite(target_[t]);
      if (usable) {
        row(t, begin, phi.data());
        for (const double v : phi) usable = usable && std::isfinite(v);
      }
      if (t < end && !usable) ++missing_rows_;
      if (usable && first < 0) first = t;
      if (!usable && first >= 0) {
        ranges_.push_back({first, t, begin});
        first = -1;
      }
    }
  }
}

Index Regressor::rows() const {
  Index n = 0;
  for (const RowRange& r : ranges_) n += r.last - r.first;
  return n;
}

Mat Regressor::matrix() const {
  Eigen::Matrix<double, Eigen::Dynamic, Eigen::Dynamic, Eigen::RowMajor> m(rows(), columns());
  Index i = 0;
  for (const RowRange& r : ranges_)
    for (Index t = r.first; t < r.last; ++t) row(t, r.begin, m.data() + columns() * i++);
  return m;
}

Vec Regressor::targets() const {
  Vec y(rows());
  Index i = 0;
  for (const RowRange& r : ranges_)
    for (Index t = r.first; t < r.last; ++t) y[i++] = target_[t];
  return y;
}

}  // namespace pendula::sysid

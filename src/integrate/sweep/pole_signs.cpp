#include "integrate/sweep/pole_signs.hpp"

#include <algorithm>
#include <cmath>

#include "dae/singular/domain_conditions.hpp"

namespace pendula::integrate {

PoleSigns::PoleSigns(const dae::FirstOrder& form) : n_(form.x.size()), p_(form.p.size()) {
  std::vector<Expr> divisors, arguments{time_symbol()};
  for (const dae::DomainCondition& c : dae::domain_conditions(form.F))
    if (c.pole) divisors.push_back(c.factor);
  if (divisors.empty()) return;
  arguments.insert(arguments.end(), form.x.begin(), form.x.end());
  arguments.insert(arguments.end(), form.p.begin(), form.p.end());
  kernel_ = codegen::Kernel(divisors, arguments);
  in_.resize(arguments.size());
  out_.resize(divisors.size());
}

const std::vector<double>& PoleSigns::evaluate(double t, const double* x, const double* p) {
  in_[0] = t;
  std::copy_n(p, p_, std::copy_n(x, n_, in_.begin() + 1));
  kernel_(in_.data(), out_.data());
  return out_;
}

void PoleSigns::start(int run, double t, const double* x, const double* p) {
  if (empty()) return;
  Run& r = runs_[run] = {};
  for (double g : evaluate(t, x, p)) {
    r.positive.push_back(g > 0);
    r.changed = r.changed || !(std::fabs(g) > 0);
  }
}

void PoleSigns::update(int run, double t, const double* x, const double* p) {
  if (empty()) return;
  const auto at = runs_.find(run);
  if (at == runs_.end()) return;  // abandoned since; its last points are still arriving
  Run& r = at->second;
  evaluate(t, x, p);
  for (std::size_t i = 0; i < out_.size(); ++i)
    r.changed = r.changed || !(r.positive[i] ? out_[i] > 0 : out_[i] < 0);
}

bool PoleSigns::changed(int run) {
  const auto at = runs_.find(run);
  if (at == runs_.end()) return false;
  const bool result = at->second.changed;
  runs_.erase(at);
  return result;
}

}  // namespace pendula::integrate

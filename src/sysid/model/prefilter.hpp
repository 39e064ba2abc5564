// Prefilters and delays of the signals: what is done to data before a model is fitted.
#pragma once

#include "sysid/data/iddata.hpp"

namespace pendula::sysid {

/// num/den in powers of q⁻¹, den[0] ≠ 0.
struct FilterSection {
  Vec num, den;
};

/// Butterworth filters of this order: frequencies above `low` and below `high` pass (rad/s; low = 0
/// or high = ∞: no limit on that side). Sections of order 2 by Tustin's rule, corners exact
/// (Oppenheim & Schafer, Discrete-Time Signal Processing, 3rd ed., §7.2). Throws Error unless
/// 0 ≤ low < high and a corner lies below π/Ts
std::vector<FilterSection> butterworth(double low, double high, int order, double Ts);

/// Every signal of every experiment through all sections, from rest. The same filter on y and u leaves the
/// model as it is and weighs its errors (Ljung, 2nd ed., §14.4). Throws Error on missing samples
IdData filtered(const IdData& d, const std::vector<FilterSection>& sections);

/// Signals later by y, u samples (≥ 0, one number each); the rows without values at the beginning of each
/// experiment are left out. Throws Error where nothing is left
IdData delayed(const IdData& d, const std::vector<Index>& y, const std::vector<Index>& u);

}  // namespace pendula::sysid

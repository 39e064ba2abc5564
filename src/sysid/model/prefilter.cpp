#include "sysid/model/prefilter.hpp"

#include <algorithm>
#include <cmath>

#include "base/error.hpp"
#include "base/text.hpp"
#include "sysid/model/model.hpp"

namespace pendula::sysid {
namespace {

/// 1/(s² + 2ζ w s + w²) times w² (lowpass) or s² (highpass), or of first order, with s = (1 - q⁻¹)/(1 + q⁻¹).
FilterSection section(double w, double zeta, bool lowpass) {
  FilterSection f{Vec(3), Vec(3)};
  f.den << 1 + 2 * zeta * w + w * w, 2 * (w * w - 1), 1 - 2 * zeta * w + w * w;
  f.num << 1, lowpass ? 2.0 : -2.0, 1;
  if (lowpass) f.num *= w * w;
  return f;
}
FilterSection first_order(double w, bool lowpass) {
  FilterSection f{Vec(2), Vec(2)};
  f.den << 1 + w, w - 1;
  f.num << 1, lowpass ? 1.0 : -1.0;
  if (lowpass) f.num *= w;
  return f;
}

void append(std::vector<FilterSection>& out, double w, int order, bool lowpass) {
  for (int k = 0; k < order / 2; ++k)
    out.push_back(section(w, std::sin(M_PI * (2 * k + 1) / (2 * order)), lowpass));
  if (order % 2) out.push_back(first_order(w, lowpass));
}

Vec delayed_signal(const Vec& x, Index by, Index lost) { return x.segment(lost - by, x.size() - lost); }

}  // namespace

std::vector<FilterSection> butterworth(double low, double high, int order, double Ts) {
  const double nyquist = M_PI / Ts;
  // a choice: with sections of second order no digits are lost, but beyond it filters ring for long
  if (order < 1 || order > 20) throw Error(text("order must lie between 1 and 20, got ", order));
  if (!(low >= 0 && low < high))
    throw Error(text("w = { low, high } needs 0 ≤ low < high, got ", shortest(low), " and ", shortest(high)));
  if (low >= nyquist || (low == 0 && high >= nyquist))
    throw Error(text("this filter passes all frequencies or none: data contain those up to π/Ts = ",
                     rounded(nyquist, 6), " rad/s; w is in rad/s"));
  std::vector<FilterSection> out;
  if (low > 0) append(out, std::tan(low * Ts / 2), order, false);
  if (high < nyquist) append(out, std::tan(high * Ts / 2), order, true);
  return out;
}

IdData filtered(const IdData& d, const std::vector<FilterSection>& sections) {
  if (missing(d) > 0) throw Error(text(missing_text(d), "; fill them first: d:fill():filter(…)"));
  IdData out = d;
  for (const FilterSection& f : sections)
    for (Index k = 0; k < d.experiments(); ++k) {
      const Index from = d.starts[k], n = d.end(k) - from;
      for (Mat* m : {&out.y, &out.u})
        for (Index j = 0; j < m->cols(); ++j)
          m->col(j).segment(from, n) = filtered(f.num, f.den, m->col(j).segment(from, n));
    }
  if (!out.y.allFinite() || !out.u.allFinite())
    throw Error("the filter is unstable: the filtered signals overflow");
  return out;
}

IdData delayed(const IdData& d, const std::vector<Index>& y, const std::vector<Index>& u) {
  Index lost = 0;
  for (const auto* list : {&y, &u})
    for (const Index k : *list) lost = std::max(lost, k);
  IdData out = d;
  out.starts.clear();
  Index total = 0;
  for (Index k = 0; k < d.experiments(); ++k) {
    if (d.end(k) - d.starts[k] <= lost)
      throw Error(
          text("a delay of ", lost, " samples leaves nothing of ",
               d.experiments() > 1 ? text("experiment ", k + 1, ", which has ") : "the data, which have ",
               d.end(k) - d.starts[k], " samples"));
    out.starts.push_back(total);
    total += d.end(k) - d.starts[k] - lost;
  }
  out.y.resize(total, d.outputs());
  out.u.resize(total, d.inputs());
  for (Index k = 0; k < d.experiments(); ++k) {
    const Index from = d.starts[k], n = d.end(k) - from, to = out.starts[k];
    for (Index j = 0; j < d.outputs(); ++j)
      out.y.col(j).segment(to, n - lost) = delayed_signal(d.y.col(j).segment(from, n), y[j], lost);
    for (Index j = 0; j < d.inputs(); ++j)
      out.u.col(j).segment(to, n - lost) = delayed_signal(d.u.col(j).segment(from, n), u[j], lost);
  }
  for (Index j = 0; j < d.outputs(); ++j) out.y_offset[j] += static_cast<double>(lost - y[j]) * d.y_slope[j];
  for (Index j = 0; j < d.inputs(); ++j) out.u_offset[j] += static_cast<double>(lost - u[j]) * d.u_slope[j];
  out.first_sample += lost;
  return out;
}

}  // namespace pendula::sysid

#include "sysid/data/iddata.hpp"

#include <cmath>

#include "base/counted.hpp"
#include "base/error.hpp"
#include "base/text.hpp"

namespace pendula::sysid {
namespace {

std::vector<std::string> default_names(Index n, const std::string& letter) {
  if (n == 1) return {letter};
  std::vector<std::string> names;
  for (Index i = 1; i <= n; ++i) names.push_back(letter + std::to_string(i));
  return names;
}

void check_infinite(const Mat& m, const std::string& what) {
  for (Index j = 0; j < m.cols(); ++j)
    for (Index i = 0; i < m.rows(); ++i)
      if (std::isinf(m(i, j)))
        throw Error(text(what, " is infinite at sample ", i + 1, "; a missing sample is written 0/0 (nan)"));
}

struct Line {
  double offset = 0, slope = 0;
};

/// Least-squares constant or line through the available samples; offset at row 0.
Line trend_of(const Eigen::Ref<const Vec>& x, Trend trend) {
  double n = 0, sum = 0, time = 0;
  for (Index i = 0; i < x.size(); ++i)
    if (std::isfinite(x[i])) {
      n += 1;
      sum += x[i];
      time += static_cast<double>(i);
    }
  if (n == 0) return {};
  const double mean = sum / n, middle = time / n;
  if (trend == Trend::mean) return {mean, 0};
  double tt = 0, tx = 0;
  for (Index i = 0; i < x.size(); ++i) {
    if (!std::isfinite(x[i])) continue;
    const double s = static_cast<double>(i) - middle;
    tt += s * s;
    tx += s * (x[i] - mean);
  }
  const double slope = tt > 0 ? tx / tt : 0;
  return {mean - slope * middle, slope};
}

void remove_trend(Mat& m, Vec& offset, Vec& slope, Trend trend) {
  for (Index j = 0; j < m.cols(); ++j) {
    const Line line = trend_of(m.col(j), trend);
    for (Index i = 0; i < m.rows(); ++i) m(i, j) -= line.offset + line.slope * static_cast<double>(i);
    offset[j] += line.offset;
    slope[j] += line.slope;
  }
}

/// Of a sample: i Ts/Ts₀ errs by ε of itself, which is less up to 4·10⁶ samples.
constexpr double sample_rounding = 1e-9;

/// A signal of one experiment, resampled at the new times. Low-pass: sin(πz)/(πz) over ten zeros to each side
/// under Hamming's window, whose stop band lies 53 dB below the pass band.
Vec resampled(const Vec& x, Index count, double ratio, Resampling how) {
  Vec out(count);
  const double width = std::max(1.0, ratio), zeros = 10, reach = zeros * width;
  const double pi = std::acos(-1.0);
  for (Index i = 0; i < count; ++i) {
    const double s = static_cast<double>(i) * ratio;
    const Index below = std::min<Index>(static_cast<Index>(std::floor(s + sample_rounding)), x.size() - 1);
    if (how == Resampling::hold) {
      out[i] = x[below];
    } else if (how == Resampling::linear) {
      const double part = std::clamp(s - static_cast<double>(below), 0.0, 1.0);
      out[i] = part < sample_rounding || below + 1 >= x.size() ? x[below]
                                                               : (1 - part) * x[below] + part * x[below + 1];
    } else {
      double sum = 0, weights = 0;
      const Index from = std::max<Index>(0, static_cast<Index>(std::ceil(s - reach)));
      const Index to = std::min<Index>(x.size() - 1, static_cast<Index>(std::floor(s + reach)));
      for (Index k = from; k <= to; ++k) {
        const double z = (s - static_cast<double>(k)) / width;
        constexpr double none = 1e-12;  // there 1 - (πz)²/6 is 1
        const double sinc = std::abs(z) < none ? 1 : std::sin(pi * z) / (pi * z);
        const double w = sinc * (0.54 + 0.46 * std::cos(pi * z / zeros));
        sum += w * x[k];
        weights += w;
      }
      out[i] = sum / weights;
    }
  }
  return out;
}

void fill_signal(Eigen::Ref<Vec> x, Filling how, const std::string& name) {
  Index last = -1;
  for (Index i = 0; i <= x.size(); ++i) {
    if (i < x.size() && !std::isfinite(x[i])) continue;
    if (last < 0 && i == x.size()) throw Error(text(name, " has no sample at all; it cannot be filled"));
    for (Index k = last + 1; k < i; ++k) {
      if (last < 0) {
        x[k] = x[i];
      } else if (i == x.size() || how == Filling::previous) {
        x[k] = x[last];
      } else {
        const double part = static_cast<double>(k - last) / static_cast<double>(i - last);
        x[k] = (1 - part) * x[last] + part * x[i];
      }
    }
    last = i;
  }
}

void append_missing(const Mat& m, const std::vector<std::string>& names, std::vector<std::string>& parts) {
  constexpr Index shown = 5;  // per signal, so that a line holds them
  for (Index j = 0; j < m.cols(); ++j) {
    std::vector<std::string> where;
    Index count = 0;
    for (Index i = 0; i < m.rows(); ++i)
      if (std::isnan(m(i, j)) && ++count <= shown) where.push_back(std::to_string(i + 1));
    if (count == 0) continue;
    if (count > shown) where.push_back("…");
    parts.push_back(text(names[j], " at sample", count == 1 ? " " : "s ", join(where, ", ")));
  }
}

void append_signals(Table& table, const Mat& m, const std::vector<std::string>& names, const char* role,
                    const Vec& offset, const Vec& slope) {
  for (Index j = 0; j < m.cols(); ++j) {
    double low = INFINITY, high = -INFINITY, sum = 0, n = 0;
    for (Index i = 0; i < m.rows(); ++i)
      if (std::isfinite(m(i, j))) {
        low = std::min(low, m(i, j));
        high = std::max(high, m(i, j));
        sum += m(i, j);
        n += 1;
      }
    const bool line = slope[j] != 0;
    constexpr double cancelled = 1e-12;  // 4500 ε; the rounding of a mean of n values grows like √n ε
    const double mean = std::abs(sum / n) < cancelled * std::max(std::abs(low), std::abs(high)) ? 0 : sum / n;
    table.row({role, names[j], n ? rounded(low, 6) : "–", n ? rounded(high, 6) : "–",
               n ? rounded(mean, 6) : "–",
               offset[j] == 0 && !line ? ""
                                       : text("removed ", rounded(offset[j], 6),
                                              line ? text(" + ", rounded(slope[j], 6), " per sample") : "")});
  }
}

}  // namespace

Index IdData::end(Index k) const {
  const auto next = static_cast<std::size_t>(k + 1);
  return next < starts.size() ? starts[next] : samples();
}

IdData checked(IdData d) {
  if (d.y.cols() == 0 || d.y.rows() == 0) throw Error("iddata: y has no samples; give y = { … }");
  if (d.u.size() == 0) d.u.resize(d.y.rows(), 0);
  if (d.u.rows() != d.y.rows())
    throw Error(text("y has ", counted(d.y.rows(), "sample"), " but u has ", d.u.rows(),
                     "; y and u must be sampled at the same times"));
  if (!(d.Ts > 0) || !std::isfinite(d.Ts)) throw Error(text("Ts must be positive, got ", shortest(d.Ts)));
  if (d.y_names.empty()) d.y_names = default_names(d.y.cols(), "y");
  if (d.u_names.empty()) d.u_names = default_names(d.u.cols(), "u");
  if (static_cast<Index>(d.y_names.size()) != d.y.cols())
    throw Error(text("y has ", counted(d.y.cols(), "column"), " but ", d.y_names.size(), " names"));
  if (static_cast<Index>(d.u_names.size()) != d.u.cols())
    throw Error(text("u has ", counted(d.u.cols(), "column"), " but ", d.u_names.size(), " names"));
  check_infinite(d.y, "y");
  check_infinite(d.u, "u");
  if (d.y_offset.size() == 0) d.y_offset = d.y_slope = Vec::Zero(d.y.cols());
  if (d.u_offset.size() == 0) d.u_offset = d.u_slope = Vec::Zero(d.u.cols());
  return d;
}

IdData slice(const IdData& d, Index first, Index last) {
  if (first < 1 || last > d.samples() || first > last)
    throw Error(
        text("samples ", first, " to ", last, " are out of range: the data has samples 1 to ", d.samples()));
  IdData part = d;
  part.y = d.y.middleRows(first - 1, last - first + 1);
  part.u = d.u.middleRows(first - 1, last - first + 1);
  part.first_sample = d.first_sample + first - 1;
  part.y_offset += static_cast<double>(first - 1) * d.y_slope;
  part.u_offset += static_cast<double>(first - 1) * d.u_slope;
  part.starts.clear();
  for (Index k = 0; k < d.experiments(); ++k) {
    const Index from = std::max<Index>(d.starts[k], first - 1);
    if (from < std::min(d.end(k), last)) part.starts.push_back(from - (first - 1));
  }
  return part;
}

std::pair<IdData, IdData> split(const IdData& d, double fraction) {
  if (!(fraction > 0 && fraction < 1))
    throw Error(text("the fraction must lie between 0 and 1, got ", shortest(fraction)));
  const auto first = static_cast<Index>(std::llround(fraction * static_cast<double>(d.samples())));
  if (first < 1 || first >= d.samples())
    throw Error(
        text("a fraction of ", shortest(fraction), " leaves one part of ", d.samples(), " samples empty"));
  return {slice(d, 1, first), slice(d, first + 1, d.samples())};
}

IdData detrend(const IdData& d, Trend trend) {
  IdData out = d;
  remove_trend(out.y, out.y_offset, out.y_slope, trend);
  remove_trend(out.u, out.u_offset, out.u_slope, trend);
  return out;
}

IdData remove_offsets(const IdData& d, const Vec& y, const Vec& u) {
  if (y.size() != d.outputs() || u.size() != d.inputs())
    throw Error(text("offsets: expected ", counted(d.outputs(), "number"), " for y and ", d.inputs(),
                     " for u, got ", y.size(), " and ", u.size()));
  IdData out = d;
  out.y.rowwise() -= y.transpose();
  out.u.rowwise() -= u.transpose();
  out.y_offset += y;
  out.u_offset += u;
  return out;
}

IdData resample(const IdData& d, double Ts, Resampling how) {
  if (!(Ts > 0) || !std::isfinite(Ts)) throw Error(text("Ts must be positive, got ", shortest(Ts)));
  if (missing(d) > 0) throw Error(text(missing_text(d), "; fill them first: d:fill():resample(Ts)"));
  const double ratio = Ts / d.Ts;
  constexpr double longest = 1e8;  // of data that fit into memory one sample would be left
  if (!(ratio <= longest))
    throw Error(text("Ts = ", shortest(Ts), " is more than 1e8 times that of the data, ", shortest(d.Ts),
                     ": at most one sample would be left"));
  IdData out = d;
  out.Ts = Ts;
  out.first_sample = 1;
  out.starts.clear();
  std::vector<Index> counts;
  Index total = 0;
  for (Index k = 0; k < d.experiments(); ++k) {
    const Index n = d.end(k) - d.starts[k];
    const double count = std::floor(static_cast<double>(n - 1) / ratio + sample_rounding) + 1;
    constexpr double most = 1e8;  // samples: 0.8 GB per signal
    if (count > most) throw Error(text("Ts = ", shortest(Ts), " would make ", count, " samples"));
    out.starts.push_back(total);
    counts.push_back(static_cast<Index>(count));
    total += counts.back();
  }
  out.y.resize(total, d.outputs());
  out.u.resize(total, d.inputs());
  for (Index k = 0; k < d.experiments(); ++k) {
    const auto i = static_cast<std::size_t>(k);
    const Index from = d.starts[i], n = d.end(k) - from;
    for (Index j = 0; j < d.outputs(); ++j)
      out.y.col(j).segment(out.starts[i], counts[i]) =
          resampled(d.y.col(j).segment(from, n), counts[i], ratio, how);
    for (Index j = 0; j < d.inputs(); ++j)
      out.u.col(j).segment(out.starts[i], counts[i]) =
          resampled(d.u.col(j).segment(from, n), counts[i], ratio, how);
  }
  out.y_slope *= ratio;
  out.u_slope *= ratio;
  return out;
}

IdData select(const IdData& d, const std::vector<Index>& y, const std::vector<Index>& u) {
  if (y.empty()) throw Error("select: at least one output must stay");
  IdData out = d;
  const auto take = [](const std::vector<Index>& which, Mat& m, std::vector<std::string>& names,
                       std::initializer_list<Vec*> others) {
    m = m(Eigen::all, which).eval();
    std::vector<std::string> kept;
    for (const Index i : which) kept.push_back(names[i]);
    names = std::move(kept);
    for (Vec* v : others)
      if (v->size() > 0) *v = (*v)(which).eval();
  };
  take(y, out.y, out.y_names, {&out.y_offset, &out.y_slope});
  take(u, out.u, out.u_names, {&out.u_offset, &out.u_slope});
  return checked(std::move(out));
}

IdData merge(const std::vector<IdData>& parts) {
  IdData out = parts.at(0);
  for (std::size_t k = 1; k < parts.size(); ++k) {
    const IdData& next = parts[k];
    if (next.outputs() != out.outputs() || next.inputs() != out.inputs())
      throw Error(text("experiment ", k + 1, " has ", counted(next.outputs(), "output"), " and ",
                       counted(next.inputs(), "input"), ", the first has ", out.outputs(), " and ",
                       out.inputs()));
    constexpr double same = 1e-9;  // relative: the times differ by less than a sample in 10⁹
    if (std::abs(next.Ts - out.Ts) > same * out.Ts)
      throw Error(text("experiment ", k + 1, " is sampled every ", shortest(next.Ts), ", the first every ",
                       shortest(out.Ts), "; resample one: d:resample(Ts)"));
    for (const Index start : next.starts) out.starts.push_back(out.samples() + start);
    Mat y(out.samples() + next.samples(), out.outputs()), u(y.rows(), out.inputs());
    y << out.y, next.y;
    if (out.inputs() > 0) u << out.u, next.u;
    out.y = std::move(y);
    out.u = std::move(u);
  }
  return out;
}

IdData fill(const IdData& d, Filling how) {
  IdData out = d;
  for (Index k = 0; k < d.experiments(); ++k) {
    const Index from = d.starts[k], n = d.end(k) - from;
    for (Index j = 0; j < d.outputs(); ++j) fill_signal(out.y.col(j).segment(from, n), how, d.y_names[j]);
    for (Index j = 0; j < d.inputs(); ++j) fill_signal(out.u.col(j).segment(from, n), how, d.u_names[j]);
  }
  return out;
}

Index missing(const IdData& d) { return d.y.array().isNaN().count() + d.u.array().isNaN().count(); }

std::string missing_text(const IdData& d) {
  const Index count = missing(d);
  if (count == 0) return "";
  std::vector<std::string> parts;
  append_missing(d.y, d.y_names, parts);
  append_missing(d.u, d.u_names, parts);
  return text(counted(count, "missing value"), ": ", join(parts, "; "));
}

std::string describe(const IdData& d) {
  std::string out = text("data: ", counted(d.samples(), "sample"), ", Ts = ", rounded(d.Ts),
                         d.assumed_Ts ? " (assumed: the file has no times; give Ts = …)" : "", ", ",
                         counted(d.outputs(), "output"), ", ", counted(d.inputs(), "input"));
  if (d.experiments() > 1) {
    std::vector<std::string> sizes;
    for (Index k = 0; k < d.experiments(); ++k) sizes.push_back(std::to_string(d.end(k) - d.starts[k]));
    out += text(", ", d.experiments(), " experiments (", join(sizes, " + "), ")");
  }
  Table table({false, false, true, true, true, false});
  table.row({"", "", "min", "max", "mean", ""});
  append_signals(table, d.y, d.y_names, "output", d.y_offset, d.y_slope);
  append_signals(table, d.u, d.u_names, "input", d.u_offset, d.u_slope);
  out += "\n" + table.str(2);
  const std::string gaps = missing_text(d);
  if (!gaps.empty()) out += "  " + gaps + "\n";
  out.pop_back();
  return out;
}

}  // namespace pendula::sysid

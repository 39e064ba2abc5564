// Measured data: outputs y and inputs u sampled every Ts, in one or several experiments.
//
// Samples are numbered from 1 in everything a user sees. A NaN is a missing sample: estimators leave out the
// rows that would need it and say how many; filters that cannot do that refuse and say what to call instead.
//
// datafile.cpp and matfile.cpp read files (mat_memory.hpp: within a limit), signals.hpp makes inputs and
// spectra, excitation.hpp asks whether an input is rich enough.
#pragma once

#include <string>
#include <utility>
#include <vector>

#include "base/math.hpp"

namespace pendula::sysid {

using Eigen::Index;

struct IdData {
  Mat y;  ///< N×ny
  Mat u;  ///< N×nu (nu = 0: a time series)
  double Ts = 1;
  bool assumed_Ts = false;  ///< read from a file that does not say Ts
  std::vector<std::string> y_names, u_names;
  std::vector<Index> starts{0};  ///< first row of each experiment (merge)
  Vec y_offset, u_offset;        ///< what detrend has removed at the first sample
  Vec y_slope, u_slope;          ///< and per sample
  Index first_sample = 1;        ///< number of row 0 in the recording it was sliced from

  Index samples() const { return y.rows(); }
  Index outputs() const { return y.cols(); }
  Index inputs() const { return u.cols(); }
  Index experiments() const { return static_cast<Index>(starts.size()); }
  /// One past the last row of experiment k.
  Index end(Index k) const;
};

/// Checks and completes: equal lengths, at least one output and sample, Ts > 0, names. Throws Error.
IdData checked(IdData data);

/// Samples first..last (1-based, inclusive). Throws Error when out of range.
IdData slice(const IdData& d, Index first, Index last);
/// The first round(fraction·N) samples and the rest. Requires 0 < fraction < 1 with samples on both sides.
std::pair<IdData, IdData> split(const IdData& d, double fraction);

enum class Trend { mean, line };
/// Removes the mean or the least-squares line of every signal, missing samples left
/// out. Remembers what was removed.
IdData detrend(const IdData& d, Trend trend);
IdData remove_offsets(const IdData& d, const Vec& y, const Vec& u);

enum class Resampling { lowpass, linear, hold };
/// The data on a new grid of step Ts. lowpass: Hamming-windowed sinc, cut off at half the lower rate (no
/// aliasing); its weights are normalised, so a constant stays one. linear and hold interpolate. Cost:
/// O(N·20·max(1, Ts_new/Ts)).
IdData resample(const IdData& d, double Ts, Resampling how);

/// Some of the signals, in the order given (column numbers from 0).
IdData select(const IdData& d, const std::vector<Index>& y, const std::vector<Index>& u);

/// The experiments one after the other; regressors never reach across the seam.
IdData merge(const std::vector<IdData>& parts);

enum class Filling { linear, previous };
/// Replaces missing samples by interpolation inside each experiment (ends: the nearest sample).
IdData fill(const IdData& d, Filling how);

/// Number of missing values, and words for them: "3 missing values: y at samples 5, 6; u at sample 9", or "".
Index missing(const IdData& d);
std::string missing_text(const IdData& d);

/// The text of print: sizes, sampling, ranges of the signals, missing values, removed offsets.
std::string describe(const IdData& d);

// ── files ──

struct FileColumns {
  std::vector<std::string> names;
  std::vector<std::vector<double>> columns;  ///< NaN: missing
};
/// Reads numbers separated by commas, semicolons, tabs or blanks (found out from the file; decimal commas
/// when the separator is a semicolon), with or without a header line; comments start with # or %. Missing:
/// empty, NaN, NA, null, "-", "?". Throws Error with line number on anything else.
FileColumns read_table(const std::string& path);
FileColumns parse_table(const std::string& text, const std::string& path);
/// The real vectors and matrices of a MATLAB file (v4, v5, v7.3 where libmatio can), also inside structures:
/// matrices give name1, name2, … throws Error.
FileColumns read_mat(const std::string& path);

/// Columns t, the inputs, the outputs (and `experiment` where there are several); missing samples are empty.
/// Numbers read back as they were. Throws Error.
void write_csv(const IdData& d, const std::string& path);
/// MATLAB version 5: matrices y and u, Ts, and the first rows `starts` of the experiments. Throws Error.
void write_mat(const IdData& d, const std::string& path);
using NamedMatrices = std::vector<std::pair<std::string, Mat>>;
/// A MATLAB file (version 5) with these matrices; the names are names of MATLAB. Throws Error where it cannot
/// be written, and where this program was built without libmatio.
/// Every real matrix of numbers in a MATLAB file; the fields of structures count as variables.
NamedMatrices read_matrices(const std::string& path);
void write_mat(const NamedMatrices& variables, const std::string& path);

struct ColumnChoice {
  std::vector<std::string> y, u;  ///< names or numbers ("3"); empty: those that begin with y, u
  double Ts = 0;                  ///< 0: from a column t or time, else 1
};
IdData from_columns(const FileColumns& table, const ColumnChoice& choice, const std::string& path);

}  // namespace pendula::sysid

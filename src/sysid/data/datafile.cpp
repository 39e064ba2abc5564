// Text tables written by instruments and spreadsheets, and MATLAB files.
#include <algorithm>
#include <charconv>
#include <cmath>
#include <filesystem>
#include <fstream>
#include <memory>
#include <sstream>

#include "base/counted.hpp"
#include "base/error.hpp"
#include "base/files/draft.hpp"
#include "base/text.hpp"
#include "expr/print/spelling.hpp"
#include "sysid/data/iddata.hpp"

namespace pendula::sysid {
namespace {

std::string trimmed(std::string s) {
  const char* const blanks = " \t\r\"'";
  const auto from = s.find_first_not_of(blanks);
  if (from == std::string::npos) return "";
  return s.substr(from, s.find_last_not_of(blanks) - from + 1);
}

std::string lower(std::string s) {
  std::transform(s.begin(), s.end(), s.begin(), [](unsigned char c) { return std::tolower(c); });
  return s;
}

std::vector<std::string> fields(const std::string& line, char separator) {
  std::vector<std::string> out;
  if (separator == ' ') {
    std::istringstream in(line);
    for (std::string word; in >> word;) out.push_back(trimmed(word));
    return out;
  }
  std::string current;
  bool quoted = false;
  for (const char c : line) {
    if (c == '"') quoted = !quoted;
    if (c == separator && !quoted) {
      out.push_back(trimmed(current));
      current.clear();
    } else {
      current += c;
    }
  }
  out.push_back(trimmed(current));
  return out;
}

bool is_missing(const std::string& word) {
  const std::string w = lower(word);
  return w.empty() || w == "nan" || w == "na" || w == "n/a" || w == "null" || w == "-" || w == "?" ||
         w == "none";
}

/// Reads a number, NaN if the value is missing; false if the word is neither.
bool read_number(std::string word, bool decimal_comma, double& value) {
  value = NAN;
  if (is_missing(word)) return true;
  if (decimal_comma) std::replace(word.begin(), word.end(), ',', '.');
  const char* first = word.data() + (word[0] == '+' ? 1 : 0);
  const auto end = std::from_chars(first, word.data() + word.size(), value);
  return end.ec == std::errc() && end.ptr == word.data() + word.size();
}

char separator_of(const std::string& line) {
  for (const char c : {';', '\t', ','})
    if (line.find(c) != std::string::npos) return c;
  return ' ';
}

/// Detects how decimal signs are used. If commas may be decimal commas, points in the same table may separate
/// thousands, so neither reading is assumed.
class DecimalSigns {
 public:
  explicit DecimalSigns(const std::string& path) : path_(path) {}
  /// Throws Error at the first number that is written differently from the preceding ones.
  void look(const std::string& word, std::size_t line) {
    for (const char sign : {',', '.'}) {
      if (word.find(sign) == std::string::npos) continue;
      Seen& own = sign == ',' ? comma_ : point_;
      const Seen& other = sign == ',' ? point_ : comma_;
      if (own.line == 0) own = {word, line};
      if (other.line != 0)
        throw Error(text(
            path_, ":", line, ": '", word, "' next to '", other.word, "' in line ", other.line,
            ": with semicolons or tabs between the values a comma is the decimal sign, if no number has a "
            "point; write numbers without signs between thousands"));
    }
  }

 private:
  struct Seen {
    std::string word;
    std::size_t line = 0;
  };
  const std::string& path_;
  Seen comma_, point_;
};

struct Lines {
  std::vector<std::string> text;
  std::vector<std::size_t> number;
};

Lines lines_of(const std::string& content) {
  Lines lines;
  std::istringstream in(content.rfind("\xEF\xBB\xBF", 0) == 0 ? content.substr(3) : content);
  std::size_t number = 0;
  for (std::string line; std::getline(in, line);) {
    ++number;
    const std::string bare = trimmed(line);
    if (bare.empty() || bare[0] == '#' || bare[0] == '%') continue;
    while (!line.empty() && line.back() == '\r') line.pop_back();
    lines.text.push_back(line);
    lines.number.push_back(number);
  }
  return lines;
}

std::size_t find_column(const FileColumns& table, const std::string& wanted, const std::string& path) {
  for (std::size_t i = 0; i < table.names.size(); ++i)
    if (table.names[i] == wanted) return i;
  for (std::size_t i = 0; i < table.names.size(); ++i)  // theta' for θ′, q1 for q₁
    if (plain_spelling(table.names[i]) == plain_spelling(wanted)) return i;
  std::size_t number = 0;
  const auto end = std::from_chars(wanted.data(), wanted.data() + wanted.size(), number);
  if (end.ec == std::errc() && end.ptr == wanted.data() + wanted.size() && number >= 1 &&
      number <= table.names.size())
    return number - 1;
  throw Error(text(path, " has no column '", wanted, "'.", did_you_mean(wanted, table.names),
                   " (columns: ", join(table.names, ", "), ")"));
}

double time_step(const std::vector<double>& t, const std::string& path) {
  if (t.size() < 2) return 1;
  for (std::size_t i = 0; i < t.size(); ++i)
    if (!std::isfinite(t[i]))
      throw Error(text(path, ": the time of sample ", i + 1,
                       " is missing; give Ts = … to use the samples as they stand"));
  const double mean = (t.back() - t.front()) / static_cast<double>(t.size() - 1);
  std::vector<double> steps;
  for (std::size_t i = 1; i < t.size(); ++i) steps.push_back(t[i] - t[i - 1]);
  std::nth_element(steps.begin(), steps.begin() + static_cast<std::ptrdiff_t>(steps.size() / 2), steps.end());
  const double median = steps[steps.size() / 2];  // robust against a single gap
  constexpr double printed = 1e-3;  // of a step: times may be rounded to it; a lost sample is a whole step
  for (std::size_t i = 1; i < t.size(); ++i)
    if (!(std::abs(t[i] - t[i - 1] - median) <= printed * std::abs(median)))
      throw Error(
          text(path, ": the times are not equidistant: from sample ", i, " to ", i + 1, " they step by ",
               rounded(t[i] - t[i - 1], 6), ", mostly by ", rounded(median, 6),
               "; give Ts = … to use the samples as they stand. A solution is written at equal times by "
               "sol:csv(\"run.csv\", { times = linspace(0, 10, 201) })"));
  return mean;
}

Mat gather(const FileColumns& table, const std::vector<std::size_t>& which) {
  const auto rows = static_cast<Index>(table.columns.empty() ? 0 : table.columns[0].size());
  Mat m(rows, static_cast<Index>(which.size()));
  for (std::size_t j = 0; j < which.size(); ++j) {
    const std::vector<double>& c = table.columns[which[j]];
    if (static_cast<Index>(c.size()) != rows)
      throw Error(text("column ", table.names[which[j]], " has ", c.size(), " samples but ", table.names[0],
                       " has ", rows));
    m.col(static_cast<Index>(j)) = Eigen::Map<const Vec>(c.data(), rows);
  }
  return m;
}

/// Removes columns without name and numbers, which result from separators at the ends of lines.
void drop_empty_columns(FileColumns& table, const std::vector<std::string>& header) {
  const auto named = [&](std::size_t j) { return j < header.size() && !header[j].empty(); };
  while (table.columns.size() > 1 && !named(table.columns.size() - 1) &&
         std::all_of(table.columns.back().begin(), table.columns.back().end(),
                     [](double v) { return std::isnan(v); }))
    table.columns.pop_back(), table.names.pop_back();
}

}  // namespace

FileColumns parse_table(const std::string& content, const std::string& path) {
  const Lines lines = lines_of(content);
  if (lines.text.empty()) throw Error(text(path, " holds no data"));
  const char separator = separator_of(lines.text[0]);
  const bool comma = separator == ';' || separator == '\t';
  FileColumns table;
  std::size_t row = 0;
  double value = 0;
  const std::vector<std::string> first = fields(lines.text[0], separator);
  const bool header = std::any_of(first.begin(), first.end(),
                                  [&](const std::string& w) { return !read_number(w, comma, value); });
  if (header) {
    table.names = first;
    row = 1;
  }
  for (std::size_t j = table.names.size(); j < first.size(); ++j)
    table.names.push_back("column" + std::to_string(j + 1));
  table.columns.resize(table.names.size());
  if (row == lines.text.size()) throw Error(text(path, " holds a header line but no data"));
  DecimalSigns signs(path);
  for (; row < lines.text.size(); ++row) {
    std::vector<std::string> words = fields(lines.text[row], separator);
    if (words.size() == table.names.size() + 1 && words.back().empty())
      words.pop_back();  // trailing separator
    if (words.size() != table.names.size())
      throw Error(text(path, ":", lines.number[row], ": ", counted(words.size(), "value"), ", but ",
                       header ? "the header names " : "the first line has ", table.names.size(),
                       separator == ',' && words.size() > table.names.size()
                           ? " (decimal commas need semicolons between the values)"
                           : ""));
    for (std::size_t j = 0; j < words.size(); ++j) {
      if (!read_number(words[j], comma, value))
        throw Error(text(path, ":", lines.number[row], ": '", words[j], "' in column ", table.names[j],
                         " is not a number"));
      if (comma && !is_missing(words[j])) signs.look(words[j], lines.number[row]);
      table.columns[j].push_back(value);
    }
  }
  drop_empty_columns(table, first.size() > 0 && header ? first : std::vector<std::string>());
  return table;
}

FileColumns read_table(const std::string& path) {
  std::ifstream in(path, std::ios::binary);
  if (!in || std::filesystem::is_directory(path)) throw Error(text("cannot open ", path));
  std::ostringstream content;
  content << in.rdbuf();
  if (content.str().find('\0') != std::string::npos)
    throw Error(
        text(path, " is not a text file; expected numbers separated by commas, semicolons or blanks"));
  return parse_table(content.str(), path);
}

void write_csv(const IdData& d, const std::string& path) {
  Draft draft(path);
  std::ostringstream out;
  out << "t";
  if (d.experiments() > 1) out << ",experiment";
  for (const auto* names : {&d.u_names, &d.y_names})
    for (const std::string& name : *names)
      out << ',' << (name.find_first_of(",;\t\"") == std::string::npos ? name : '"' + name + '"');
  out << '\n';
  const auto put = [&](double v) {
    out << ',';
    if (std::isfinite(v)) out << shortest(v);  // a missing sample becomes an empty field
  };
  for (Index k = 0; k < d.experiments(); ++k)
    for (Index i = d.starts[k]; i < d.end(k); ++i) {
      out << shortest(static_cast<double>(i - d.starts[k]) * d.Ts);
      if (d.experiments() > 1) out << ',' << k + 1;
      for (Index j = 0; j < d.inputs(); ++j) put(d.u(i, j));
      for (Index j = 0; j < d.outputs(); ++j) put(d.y(i, j));
      out << '\n';
    }
  draft.write(out.str());
  draft.publish();
}

namespace {

/// Is the name "t" or "time", possibly with a unit in brackets?
bool is_time(const std::string& name) {
  const std::string bare = trimmed(lower(name).substr(0, name.find_first_of("[(")));
  return bare == "t" || bare == "time";
}

/// First rows of experiments, from a column `experiment` (write_csv) or from `starts` (write_mat).
std::vector<Index> experiment_starts(const FileColumns& table, Index rows) {
  std::vector<Index> out{0};
  for (std::size_t i = 0; i < table.names.size(); ++i) {
    const std::vector<double>& c = table.columns[i];
    if (table.names[i] == "experiment" && static_cast<Index>(c.size()) == rows) {
      for (std::size_t k = 1; k < c.size(); ++k)
        if (c[k] != c[k - 1]) out.push_back(static_cast<Index>(k));
    } else if (table.names[i] == "starts" && static_cast<Index>(c.size()) < rows) {
      for (std::size_t k = 1; k < c.size(); ++k)
        if (c[k] > c[k - 1] && c[k] <= static_cast<double>(rows)) out.push_back(static_cast<Index>(c[k]) - 1);
    }
  }
  return out;
}

/// The times of the first experiment.
std::vector<double> first_experiment(std::vector<double> t, const std::vector<Index>& starts) {
  if (starts.size() > 1) t.resize(static_cast<std::size_t>(starts[1]));
  return t;
}

}  // namespace

IdData from_columns(const FileColumns& table, const ColumnChoice& choice, const std::string& path) {
  std::vector<std::size_t> y, u;
  for (const std::string& name : choice.y) y.push_back(find_column(table, name, path));
  for (const std::string& name : choice.u) u.push_back(find_column(table, name, path));
  IdData d;
  for (std::size_t i = 0; i < table.names.size(); ++i) {
    const std::string name = lower(table.names[i]);
    if (choice.y.empty() && name[0] == 'y') y.push_back(i);
    if (choice.y.empty() && choice.u.empty() && name[0] == 'u') u.push_back(i);
    if (choice.Ts == 0 && table.names[i] == "Ts" && table.columns[i].size() == 1) d.Ts = table.columns[i][0];
  }
  if (y.empty())
    throw Error(text(path, ": which columns are outputs? Give y = \"", table.names.back(),
                     "\" and u = … (columns: ", join(table.names, ", "), ")"));
  for (const std::size_t i : u)
    if (std::find(y.begin(), y.end(), i) != y.end())
      throw Error(text(path, ": the column ", table.names[i],
                       " is both an output and an input (columns: ", join(table.names, ", "), ")"));
  d.assumed_Ts = choice.Ts == 0 && std::none_of(table.names.begin(), table.names.end(), [](const auto& name) {
                   return is_time(name) || name == "Ts";
                 });
  if (choice.Ts != 0) d.Ts = choice.Ts;
  FileColumns chosen;
  for (const auto& group : {y, u})
    for (const std::size_t i : group) {
      chosen.names.push_back(table.names[i]);
      chosen.columns.push_back(table.columns[i]);
    }
  std::vector<std::size_t> first(y.size()), second(u.size());
  for (std::size_t i = 0; i < y.size(); ++i) {
    first[i] = i;
    d.y_names.push_back(chosen.names[i]);
  }
  for (std::size_t i = 0; i < u.size(); ++i) {
    second[i] = y.size() + i;
    d.u_names.push_back(chosen.names[y.size() + i]);
  }
  d.y = gather(chosen, first);
  d.u = gather(chosen, second);
  d.starts = experiment_starts(table, d.y.rows());
  for (std::size_t i = 0; i < table.names.size(); ++i)
    if (choice.Ts == 0 && is_time(table.names[i]))
      d.Ts = time_step(first_experiment(table.columns[i], d.starts), path);
  return checked(std::move(d));
}

}  // namespace pendula::sysid

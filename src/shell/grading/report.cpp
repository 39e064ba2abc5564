#include <cmath>
#include <iomanip>
#include <sstream>

#include "base/error.hpp"
#include "shell/grading/grade.hpp"
#include "shell/sandbox/harmless.hpp"
#include "shell/sandbox/json.hpp"

namespace pendula::shell::grading {
namespace {

using sandbox::json_number, sandbox::json_text;

std::string or_null(const std::string& words) { return words.empty() ? "null" : json_text(words); }
std::string or_null(int line) { return line > 0 ? std::to_string(line) : "null"; }

std::string json(const Verdict& v) {
  return sandbox::json_object({{"task", json_text(v.task)},
                               {"verdict", json_text(v.verdict)},
                               {"points", json_number(v.points)},
                               {"of", json_number(v.of)},
                               {"line", or_null(v.line)},
                               {"feedback", or_null(v.feedback)}});
}

std::string json(const Graded& g, double of) {
  std::vector<std::string> answers, forbidden;
  for (const Verdict& v : g.verdicts) answers.push_back("\n    " + json(v));
  for (const std::string& call : g.outcome.forbidden) forbidden.push_back(json_text(call));
  return "\n  " + sandbox::json_object({{"submission", json_text(g.submission)},
                                        {"points", json_number(g.points())},
                                        {"of", json_number(of)},
                                        {"outcome", json_text(sandbox::name_of(g.outcome.kind))},
                                        {"message", or_null(g.outcome.message)},
                                        {"forbidden", sandbox::json_list(forbidden)},
                                        {"answers", sandbox::json_list(answers)}});
}

}  // namespace

std::string json_report(const Report& report) {
  std::vector<std::string> list;
  for (const Graded& g : report.submissions) list.push_back(json(g, report.of));
  return sandbox::json_object({{"title", json_text(report.title)},
                               {"of", json_number(report.of)},
                               {"submissions", sandbox::json_list(list)}}) +
         "\n";
}

/// Names, messages and feedback contain text from the submissions, which must not begin a new line
/// of the report.
std::string text_report(const Report& report) {
  using sandbox::harmless_part;
  std::ostringstream out;
  if (!report.title.empty()) out << report.title << "\n\n";
  for (const Graded& g : report.submissions) {
    out << harmless_part(g.submission) << ": " << g.points() << " of " << report.of << "\n";
    if (g.outcome.kind != sandbox::Kind::finished) {
      out << "  " << sandbox::name_of(g.outcome.kind);
      for (const std::string& call : g.outcome.forbidden) out << " " << harmless_part(call);
      out << (g.outcome.message.empty() ? "" : ": " + harmless_part(g.outcome.message)) << "\n";
    }
    for (const Verdict& v : g.verdicts) {
      out << "  " << std::left << std::setw(16) << v.task << std::setw(11) << v.verdict << v.points << " of "
          << v.of;
      if (v.line > 0) out << "  line " << v.line;
      if (!v.feedback.empty()) out << "  " << harmless_part(v.feedback);
      out << "\n";
    }
  }
  return out.str();
}

}  // namespace pendula::shell::grading

#include "shell/grading/grade.hpp"

#include <fcntl.h>
#include <sys/stat.h>
#include <unistd.h>

#include <algorithm>
#include <array>
#include <atomic>
#include <cerrno>
#include <cstdlib>
#include <cstring>
#include <exception>
#include <filesystem>
#include <fstream>
#include <memory>
#include <sstream>
#include <thread>

#include "base/error.hpp"
#include "base/interrupt.hpp"
#include "lua/session/answers.hpp"
#include "lua/session/forbidden_calls.hpp"
#include "lua/session/state.hpp"

namespace pendula::shell::grading {
namespace {

namespace fs = std::filesystem;

constexpr char separator = '\x1f';  // between the fields of a result; no field contains it
constexpr double grader_seconds = 60;

struct Task {
  std::string name;
  double points = 0;
};

std::string read(const std::string& path) {
  std::ifstream file(path, std::ios::binary);
  std::ostringstream text;
  if (!file || fs::is_directory(path) || !(text << file.rdbuf())) {
    // inserting the buffer of an empty file sets failbit
    if (file && fs::exists(path) && !fs::is_directory(path)) return "";
    throw Error("grade: cannot read '" + path + "'");
  }
  return text.str();
}

/// Reads a regular file that is no symbolic link: a link could lead to the file of another student or of the
/// teacher. The file is opened only once, so that the checks apply to the file that is read.
std::string read_submission(const std::string& path) {
  static constexpr std::size_t most = 4 << 20;
  const int file = open(path.c_str(), O_RDONLY | O_NOFOLLOW | O_NONBLOCK | O_CLOEXEC);
  if (file < 0 && errno == ELOOP) throw Error("it is a symbolic link; hand in the file itself");
  if (file < 0) throw Error(text("it cannot be read: ", std::strerror(errno)));
  const std::unique_ptr<const int, void (*)(const int*)> closed(&file, [](const int* f) { close(*f); });
  struct stat about {};
  if (fstat(file, &about) != 0 || !S_ISREG(about.st_mode)) throw Error("it is no regular file");
  const auto limit = [](std::size_t size) {
    if (size > most) throw Error(text("it has ", size, " bytes; a submission has at most ", most));
  };
  limit(static_cast<std::size_t>(about.st_size));
  std::string source;
  std::array<char, 1 << 16> block;
  for (;;) {
    const ssize_t size = ::read(file, block.data(), block.size());
    if (size < 0 && errno == EINTR) continue;
    if (size < 0) throw Error(text("it cannot be read: ", std::strerror(errno)));
    if (size == 0) return source;
    source.append(block.data(), static_cast<std::size_t>(size));
    limit(source.size());
  }
}

std::string joined(const std::vector<std::string>& fields) {
  std::string row;
  for (const std::string& field : fields) row += (row.empty() ? "" : std::string(1, separator)) + field;
  return row;
}

std::vector<std::string> fields_of(const std::string& row) {
  std::vector<std::string> fields{""};
  for (char c : row)
    if (c == separator)
      fields.emplace_back();
    else
      fields.back() += c;
  return fields;
}

/// A Lua state in the sandbox.
class Confined {
 public:
  Confined(sandbox::Reporter& reporter, std::size_t memory)
      : reporter_(reporter), state_(lua::new_state(), lua_close) {
    lua::forbid_calls(state_.get(), report_, memory / 8 * 7);
  }
  lua_State* L() { return state_.get(); }
  sandbox::Reporter& reporter() { return reporter_; }

 private:
  sandbox::Reporter& reporter_;
  const std::function<void(const std::string&)> report_ = [this](const std::string& call) {
    reporter_.forbidden(call);
  };
  std::unique_ptr<lua_State, decltype(&lua_close)> state_;
};

sandbox::Outcome confined(const sandbox::Limits& limits, const std::function<bool(Confined&)>& work) {
  const auto prepare = [&](sandbox::Reporter& reporter) -> sandbox::Work {
    auto inside = std::make_shared<Confined>(reporter, limits.memory);
    return [inside, &work] { return work(*inside); };
  };
  return sandbox::run(limits, prepare, [](int, const char*, std::size_t) {});
}

/// Runs the text of a submission; an error is sent to the reporter.
bool run_submission(Confined& inside, std::string source, const std::string& name) {
  lua_State* L = inside.L();
  if (source.rfind("\xEF\xBB\xBF", 0) == 0) source.erase(0, 3);
  if (source.rfind('#', 0) == 0) source.erase(0, source.find('\n'));
  const bool good = luaL_loadbufferx(L, source.data(), source.size(), ("@" + name).c_str(), "t") == LUA_OK &&
                    lua::run(L, 0, 0);
  if (good) return true;
  const char* text = lua_tostring(L, -1);
  inside.reporter().message(text ? text : "an error without a text");
  lua_settop(L, 0);
  return false;
}

class Grader {
 public:
  explicit Grader(const Request& request)
      : request_(request), source_(read(request.tasks)), file_(fs::path(request.tasks).filename().string()) {
    trusted_.seconds = grader_seconds;
    trusted_.memory = std::max(request.limits.memory, std::size_t{1} << 30);
    const auto folder = fs::path(request.tasks).parent_path();
    trusted_.folder = folder.empty() ? "." : folder.string();
    trusted_.writable = false;
    read_tasks();
  }

  const std::string& title() const { return title_; }
  double points() const {
    double sum = 0;
    for (const Task& task : tasks_) sum += task.points;
    return sum;
  }

  Graded grade(const std::string& path) const {
    Graded graded;
    graded.submission = fs::path(path).filename().string();
    graded.outcome = run(path);
    std::vector<std::vector<std::string>> answers;
    for (const std::string& row : graded.outcome.results)
      if (auto fields = fields_of(row); fields.size() == 3) answers.push_back(std::move(fields));
    judge(answers, graded);
    return graded;
  }

 private:
  void read_tasks() {
    const sandbox::Outcome read = confined(trusted_, [&](Confined& inside) {
      for (const auto& row : lua::call_grader(inside.L(), "tasks", {source_, file_}))
        inside.reporter().result(joined(row));
      return true;
    });
    if (read.kind != sandbox::Kind::finished)
      throw Error("grade: the tasks cannot be used: " +
                  (read.message.empty() ? joined(read.forbidden) : read.message));
    for (const std::string& row : read.results) {
      const auto fields = fields_of(row);
      if (fields.size() == 2 && fields[0] == "title")
        title_ = fields[1];
      else
        tasks_.push_back({fields[0], std::strtod(fields[1].c_str(), nullptr)});
    }
  }

  /// The outcome contains the answers, also those given before a submission failed.
  sandbox::Outcome run(const std::string& path) const {
    std::string source;
    try {
      source = read_submission(path);
    } catch (const Error& e) {
      sandbox::Outcome unread;
      unread.kind = sandbox::Kind::error;
      unread.message = e.what();
      return unread;
    }
    const std::string name = fs::path(path).filename().string();
    std::vector<std::string> names;
    for (const Task& task : tasks_) names.push_back(task.name);
    sandbox::Limits limits = request_.limits;
    limits.writable = false;
    return confined(limits, [&](Confined& inside) {
      lua::record_answers(inside.L(), names);
      const bool good = run_submission(inside, source, name);
      for (const lua::Answer& a : lua::answers(inside.L(), names))
        inside.reporter().result(joined({a.name, a.line, a.text}));
      return good;
    });
  }

  void judge(const std::vector<std::vector<std::string>>& answers, Graded& graded) const {
    const sandbox::Outcome judged = confined(trusted_, [&](Confined& inside) {
      lua::call_grader(inside.L(), "tasks", {source_, file_});
      for (const auto& answer : answers)
        for (const auto& row : lua::call_grader(inside.L(), "answer", {answer[0], answer[2]}))
          inside.reporter().result(joined(row));
      return true;
    });
    for (const Task& task : tasks_) {
      Verdict verdict{task.name, "missing", 0, task.points, 0, ""};
      for (const auto& answer : answers)
        if (answer[0] == task.name) {
          verdict.line = std::atoi(answer[1].c_str());
          verdict.verdict = "not graded";
          verdict.feedback = judged.message;
        }
      for (const std::string& row : judged.results) {
        const auto fields = fields_of(row);
        if (fields.size() != 5 || fields[0] != task.name) continue;
        verdict.verdict = fields[1];
        verdict.points = std::strtod(fields[2].c_str(), nullptr);
        verdict.feedback = fields[4];
      }
      graded.verdicts.push_back(verdict);
    }
  }

  const Request& request_;
  std::string source_, file_, title_;
  sandbox::Limits trusted_;
  std::vector<Task> tasks_;
};

std::vector<std::string> files_of(const std::vector<std::string>& paths) {
  std::vector<std::string> files;
  for (const std::string& path : paths) {
    std::error_code ignored;
    if (!fs::is_directory(path, ignored)) {
      if (!fs::exists(fs::symlink_status(path, ignored))) throw Error("grade: there is no '" + path + "'");
      files.push_back(path);
      continue;
    }
    for (const auto& entry : fs::directory_iterator(path))
      if (entry.path().extension() == ".lua" && !entry.is_directory(ignored))
        files.push_back(entry.path().string());
  }
  std::sort(files.begin(), files.end());
  if (files.empty()) throw Error("grade: there is no submission (*.lua)");
  return files;
}

}  // namespace

double Graded::points() const {
  double sum = 0;
  for (const Verdict& v : verdicts) sum += v.points;
  return sum;
}

Report grade(const Request& request) {
  const std::vector<std::string> files = files_of(request.submissions);
  const Grader grader(request);
  Report report{grader.title(), grader.points(), std::vector<Graded>(files.size())};
  std::atomic<std::size_t> next = 0;
  std::vector<std::exception_ptr> problems(files.size());
  // Lua states are not shared: each runs in a process of its own, for which the threads only wait.
  const auto work = [&] {
    for (std::size_t i = next++; i < files.size() && !interrupt_requested; i = next++) try {
        report.submissions[i] = grader.grade(files[i]);
      } catch (const std::exception&) {
        problems[i] = std::current_exception();
      }
  };
  const unsigned wanted =
      request.jobs > 0 ? static_cast<unsigned>(request.jobs) : std::thread::hardware_concurrency();
  std::vector<std::thread> threads;
  for (std::size_t k = 0; k < std::min<std::size_t>(std::max(1U, wanted), files.size()); ++k)
    threads.emplace_back(work);
  for (std::thread& thread : threads) thread.join();
  for (const auto& problem : problems)
    if (problem) std::rethrow_exception(problem);
  if (interrupt_requested) throw Interrupted();
  return report;
}

}  // namespace pendula::shell::grading

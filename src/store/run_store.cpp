#include "store/run_store.hpp"

#include <algorithm>
#include <cctype>
#include <cmath>
#include <cstring>
#include <limits>

#include <fcntl.h>
#include <sys/file.h>
#include <unistd.h>

#include "base/error.hpp"
#include "base/text.hpp"

namespace pendula::store {
namespace {

constexpr int version = 1;  ///< of the layout of the tables
constexpr std::size_t most_columns = 500;

std::string quoted(const std::string& name) {
  std::string result = "\"";
  for (char c : name) result += c == '"' ? std::string("\"\"") : std::string(1, c);
  return result + '"';
}

void read_numbers(std::string_view bytes, std::vector<double>& numbers) {
  numbers.resize(bytes.size() / sizeof(double));
  std::memcpy(numbers.data(), bytes.data(), numbers.size() * sizeof(double));
}

}  // namespace

RunStore::RunStore(const std::string& file, const Description& description) : database_(file, true) {
  Statement tables(database_, "SELECT count(*) FROM sqlite_master");
  tables.step();
  if (tables.integer(0) == 0) {
    create(description);
    return;
  }
  read_description();
  if (description_.fingerprint != description.fingerprint)
    throw Error(text("'", file, "' holds another sweep (", description_.runs, " runs",
                     description_.program == description.program ? "" : ", made by " + description_.program,
                     "): model, options, seed or version differ, and results must not be mixed. ",
                     "Give store another name, or remove the file"));
}

RunStore::RunStore(const std::string& file) : database_(file, false) { read_description(); }

void RunStore::create(const Description& description) {
  description_ = description;
  name_columns();
  Transaction transaction(database_);
  database_.run("CREATE TABLE sweep (key TEXT PRIMARY KEY, value) WITHOUT ROWID");
  database_.run("CREATE TABLE quantity (number INTEGER PRIMARY KEY, name TEXT, role TEXT, column TEXT)");
  database_.run("CREATE TABLE time (number INTEGER PRIMARY KEY, t REAL)");
  std::string runs =
      "CREATE TABLE runs (run INTEGER PRIMARY KEY, status TEXT NOT NULL, why TEXT, t REAL, steps INTEGER, rejected "
      "INTEGER, evaluations INTEGER";
  for (const std::string& column : columns_) runs += ", " + quoted(column) + " REAL";
  database_.run(runs + ", final BLOB)");
  database_.run("CREATE INDEX failed ON runs (run) WHERE status = 'failed'");
  database_.run("CREATE TABLE saved (run INTEGER PRIMARY KEY, block BLOB NOT NULL)");
  database_.run(text("PRAGMA user_version = ", version));
  note("fingerprint", description.fingerprint);
  note("program", description.program);
  note("model", description.model);
  note("options", description.options);
  note("hidden", description.hidden);
  note("runs", std::to_string(description.runs));
  Statement quantity(database_, "INSERT INTO quantity (name, role, column) VALUES (?, ?, ?)");
  std::size_t next = 0;
  const auto add_quantity = [&](const std::string& name, const char* role, bool has_column) {
    quantity.bind(0, std::string_view(name));
    quantity.bind(1, std::string_view(role));
    if (has_column) quantity.bind(2, std::string_view(columns_[next++]));
    quantity.step();
  };
  for (const std::string& name : description.varied) add_quantity(name, "varied", true);
  for (std::size_t i = 0; i < description.leaves.size(); ++i)
    add_quantity(description.leaves[i], "kept", description.shown[i]);
  Statement time(database_, "INSERT INTO time (number, t) VALUES (?, ?)");
  for (std::size_t k = 0; k < description.times.size(); ++k) {
    time.bind(0, static_cast<std::int64_t>(k + 1));
    time.bind(1, description.times[k]);
    time.step();
  }
  transaction.commit();
}

/// Makes the column names unique without regard to case, as SQLite compares them.
void RunStore::name_columns() {
  Description& d = description_;
  std::size_t shown = 0;
  for (std::size_t i = 0; i < d.shown.size(); ++i) {
    if (d.shown[i] && d.varied.size() + shown >= most_columns) d.shown[i] = false;
    shown += d.shown[i] ? 1 : 0;
  }
  std::vector<std::string> used = {"run", "status", "why", "t", "steps", "rejected", "evaluations", "final"};
  const auto add = [&](const std::string& name) {
    const auto lower = [](std::string s) {
      std::transform(s.begin(), s.end(), s.begin(), [](unsigned char c) { return std::tolower(c); });
      return s;
    };
    std::string column = name;
    for (int k = 2; std::find(used.begin(), used.end(), lower(column)) != used.end(); ++k)
      column = text(name, "_", k);
    used.push_back(lower(column));
    columns_.push_back(column);
  };
  for (const std::string& name : d.varied) add(name);
  for (std::size_t i = 0; i < d.leaves.size(); ++i)
    if (d.shown[i]) add(d.leaves[i]);
}

void RunStore::read_description() {
  Statement found(database_, "PRAGMA user_version");
  found.step();
  Statement tables(
      database_,
      "SELECT count(*) FROM sqlite_master WHERE name IN ('sweep', 'quantity', 'time', 'runs', 'saved')");
  tables.step();
  if (tables.integer(0) != 5)
    throw Error("'" + file() + "' is a database, but not a store of runs; give store another name");
  if (found.integer(0) != version)
    throw Error(text("'", file(), "' was made by another version of pendula (tables ", found.integer(0),
                     ", known are ", version, ")"));
  Description& d = description_;
  d.fingerprint = noted("fingerprint");
  d.program = noted("program");
  d.model = noted("model");
  d.options = noted("options");
  d.hidden = noted("hidden");
  d.runs = std::stol("0" + noted("runs"));
  Statement quantity(database_, "SELECT name, role, column FROM quantity ORDER BY number");
  while (quantity.step()) {
    const std::string column = quantity.text(2);
    if (!column.empty()) columns_.push_back(column);
    if (quantity.text(1) == "varied") {
      d.varied.push_back(quantity.text(0));
    } else {
      d.leaves.push_back(quantity.text(0));
      d.shown.push_back(!column.empty());
    }
  }
  Statement time(database_, "SELECT t FROM time ORDER BY number");
  while (time.step()) d.times.push_back(time.number(0));
}

RunStore::Lock::Lock(const RunStore& store) : file_(::open(store.file().c_str(), O_RDONLY | O_CLOEXEC)) {
  if (file_ < 0) throw Error("cannot open '" + store.file() + "'");
  if (flock(file_, LOCK_EX | LOCK_NB) == 0) return;
  close(file_);
  throw Error("'" + store.file() + "' is being written by another sweep; wait until it is done, or end it");
}

RunStore::Lock::~Lock() { close(file_); }

std::string RunStore::insert_text() const {
  std::string names = "run, status, why, t, steps, rejected, evaluations", places = "?, ?, ?, ?, ?, ?, ?";
  for (const std::string& column : columns_) {
    names += ", " + quoted(column);
    places += ", ?";
  }
  return "INSERT OR IGNORE INTO runs (" + names + ", final) VALUES (" + places + ", ?)";
}

void RunStore::add(std::span<const Record> records) {
  if (records.empty()) return;
  const Description& d = description_;
  Transaction transaction(database_);
  Statement insert(database_, insert_text());
  Statement saved(database_, "INSERT OR IGNORE INTO saved (run, block) VALUES (?, ?)");
  for (const Record& r : records) {
    int place = 0;
    insert.bind(place++, static_cast<std::int64_t>(r.run + 1));
    insert.bind(place++, std::string_view(r.done ? "done" : "failed"));
    if (!r.done) insert.bind(place, std::string_view(r.why));
    ++place;
    for (int k = 0; k < Record::head; ++k, ++place)
      if (r.done) insert.bind(place, r.numbers[k]);
    for (double v : r.varied) insert.bind(place++, v);
    const double* leaves = r.numbers.data() + Record::head;
    for (std::size_t i = 0; i < d.leaves.size(); ++i) {
      if (!d.shown[i]) continue;
      if (r.done) insert.bind(place, leaves[i]);
      ++place;
    }
    if (r.done) insert.bind_blob(place, leaves, d.leaves.size() * sizeof(double));
    insert.step();
    if (!r.done || d.times.empty()) continue;
    saved.bind(0, static_cast<std::int64_t>(r.run + 1));
    const std::string block = compressed({leaves + d.leaves.size(), d.leaves.size() * d.times.size()});
    saved.bind_blob(1, block.data(), block.size());
    saved.step();
  }
  transaction.commit();
}

void RunStore::forget_failures() { database_.run("DELETE FROM runs WHERE status = 'failed'"); }

void RunStore::note(const std::string& key, const std::string& value) {
  Statement insert(database_, "INSERT OR REPLACE INTO sweep (key, value) VALUES (?, ?)");
  insert.bind(0, std::string_view(key));
  insert.bind(1, std::string_view(value));
  insert.step();
}

std::string RunStore::noted(const std::string& key) const {
  Statement select(database_, "SELECT value FROM sweep WHERE key = ?");
  select.bind(0, std::string_view(key));
  return select.step() ? select.text(0) : "";
}

long RunStore::done() const {
  Statement all(database_, "SELECT count(*) FROM runs");
  all.step();
  return static_cast<long>(all.integer(0)) - static_cast<long>(failed().size());
}

std::vector<bool> RunStore::finished() const {
  std::vector<bool> result(static_cast<std::size_t>(description_.runs));
  Statement select(database_, "SELECT run FROM runs");
  while (select.step())
    if (const auto run = select.integer(0); run >= 1 && run <= description_.runs) result[run - 1] = true;
  return result;
}

std::vector<long> RunStore::failed() const {
  std::vector<long> result;
  Statement select(database_, "SELECT run FROM runs WHERE status = 'failed' ORDER BY run");
  while (select.step()) result.push_back(static_cast<long>(select.integer(0)) - 1);
  return result;
}

RunStore::State RunStore::state(long run) const {
  Statement select(database_, "SELECT status FROM runs WHERE run = ?");
  select.bind(0, static_cast<std::int64_t>(run + 1));
  if (!select.step()) return State::waiting;
  return select.text(0) == "done" ? State::done : State::failed;
}

std::string RunStore::failure(long run) const {
  Statement select(database_, "SELECT why FROM runs WHERE run = ?");
  select.bind(0, static_cast<std::int64_t>(run + 1));
  return select.step() ? select.text(0) : "not run yet";
}

void RunStore::visit(std::size_t place, const Visitor& visitor) const {
  const std::size_t width = description_.leaves.size();
  std::vector<double> leaves;
  Statement select(
      database_,
      place == 0
          ? "SELECT run, t, steps, rejected, evaluations, final FROM runs WHERE status = 'done' ORDER BY 1"
          : "SELECT run, t, steps, rejected, evaluations, block FROM runs JOIN saved USING (run) "
            "WHERE status = 'done' ORDER BY 1");
  while (select.step()) {
    double head[Record::head];
    for (int k = 0; k < Record::head; ++k) head[k] = select.number(k + 1);
    if (place == 0) {
      read_numbers(select.blob(5), leaves);
      if (leaves.size() != width) throw Error("'" + file() + "' is damaged: run " + select.text(0));
      visitor(static_cast<long>(select.integer(0)) - 1, head, leaves.data());
    } else {
      leaves.resize(width * description_.times.size());
      decompress(select.blob(5), leaves);
      visitor(static_cast<long>(select.integer(0)) - 1, head, leaves.data() + width * (place - 1));
    }
  }
}

}  // namespace pendula::store

// The results of a sweep in one SQLite file. Its tables are documented in docs/store.md.
//
// One process writes (it holds a lock on the file), any number read. Runs are added in transactions: a
// process that is killed loses those of its last second, never the file.
#pragma once

#include <functional>
#include <memory>
#include <span>
#include <string>
#include <vector>

#include "store/database.hpp"
#include "store/record.hpp"

namespace pendula::store {

/// Data common to the runs of a store.
struct Description {
  std::string fingerprint;     ///< of everything that the results depend on
  std::string program;         ///< name and version of what made them
  std::string model, options;  ///< as Lua text
  std::string hidden;          ///< options that the text leaves out
  long runs = 0;
  std::vector<std::string> varied;  ///< what varies from run to run
  std::vector<std::string> leaves;  ///< what is kept of each run, in the order of the numbers
  std::vector<bool> shown;          ///< leaves with a column of their own
  std::vector<double> times;        ///< saved times
};

class RunStore : public RunSink {
 public:
  enum class State { waiting, done, failed };

  /// Creates the file, or goes on with one of the same fingerprint. Throws Error where the file holds another
  /// sweep, is no store, cannot be written.
  RunStore(const std::string& file, const Description& description);
  /// An existing one.
  explicit RunStore(const std::string& file);
  RunStore(const RunStore&) = delete;
  RunStore& operator=(const RunStore&) = delete;

  const std::string& file() const { return database_.file(); }
  const Description& description() const { return description_; }

  /// While it lives, this process writes. Throws Error where another one does.
  class Lock {
   public:
    explicit Lock(const RunStore& store);
    ~Lock();
    Lock(const Lock&) = delete;
    Lock& operator=(const Lock&) = delete;

   private:
    int file_;
  };
  void add(std::span<const Record> records) override;
  /// Forgets the runs that failed, so that they are made again.
  void forget_failures();
  /// Settings that belong to the sweep: how and where its runs are made.
  void note(const std::string& key, const std::string& value);
  std::string noted(const std::string& key) const;  ///< "" if there is none

  long done() const;
  std::vector<bool> finished() const override;
  std::vector<long> failed() const;
  State state(long run) const;
  std::string failure(long run) const;
  /// Of every run that is done, ascending: head, and the leaves at the end (place 0)
  /// or at saved time `place` - 1.
  using Visitor = std::function<void(long run, const double* head, const double* leaves)>;
  void visit(std::size_t place, const Visitor& visitor) const;

 private:
  void create(const Description& description);
  void read_description();
  void name_columns();
  std::string insert_text() const;

  mutable Database database_;
  Description description_;
  std::vector<std::string> columns_;  ///< of table runs: those of what varies, then those of the shown leaves
};

/// Numbers as a compressed block: little-endian doubles, their first bytes, then
/// their second ones, …, by zlib.
std::string compressed(std::span<const double> numbers);
/// Throws Error where the block is damaged.
void decompress(std::string_view block, std::span<double> numbers);

}  // namespace pendula::store

// One finished run, and who takes it.
#pragma once

#include <span>
#include <string>
#include <vector>

namespace pendula::store {

struct Record {
  static constexpr int head = 4;  ///< end time, steps, rejected, evaluations
  long run = 0;                   ///< from 0
  bool done = true;
  std::string why;              ///< it failed
  std::vector<double> varied;   ///< the values of what varies
  std::vector<double> numbers;  ///< head, leaves at the end, leaves at each saved time; empty if it failed
};

class RunSink {
 public:
  virtual ~RunSink() = default;
  /// All of them or none; runs that are there already stay as they are. Throws
  /// Failure where the disk is full.
  virtual void add(std::span<const Record> records) = 0;
  /// By run: it is there, done or failed.
  virtual std::vector<bool> finished() const = 0;
};

}  // namespace pendula::store

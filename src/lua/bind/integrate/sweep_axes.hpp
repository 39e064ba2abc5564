// The axes of a sweep: lists and distributions in params and start of sweep.
#pragma once

#include "dae/model/model.hpp"
#include "lua/core/call.hpp"
#include "lua/core/values.hpp"
#include "random/sample_space.hpp"

namespace pendula::lua {

/// A column of the sweep and where its values go: to a parameter or initial value, or to the whole start.
struct SweepAxis {
  random::Column column;
  Expr leaf;
  bool parameter = false, starts = false;
};

/// Reads params and start of the table of options at argument 2.
class AxisReader {
 public:
  AxisReader(Call& call, dae::ModelPtr model);
  ~AxisReader();
  AxisReader(const AxisReader&) = delete;
  AxisReader& operator=(const AxisReader&) = delete;

  void read_params();
  void read_start();
  const std::vector<SweepAxis>& axes() const { return axes_; }
  std::vector<Expr> given_;
  /// start is a table of names and values.
  bool has_keyed_start() const { return keyed_start_; }
  /// Pushes an option as it was given; its place on the stack.
  int original(const char* key);
  /// References to tables: all options; params and start without what varies.
  int options() const { return original_; }
  int fixed_params() const { return fixed_params_; }
  int fixed_start() const { return fixed_start_; }

 private:
  void note(Expr leaf);  ///< throws where the leaf was given before
  void add(Expr leaf, bool parameter, random::Column column);
  void order_by_name(std::size_t first);
  bool sort_drawn(const SymbolEntry& entry, const std::string& what, bool parameter);
  void sort(const SymbolEntry& entry, const std::string& what, bool parameter, int fixed);
  void add_estimates(int fit);
  int named_params(int params);

  Call& call_;
  lua_State* L_;
  dae::ModelPtr model_;
  std::vector<SweepAxis> axes_;
  bool keyed_start_ = false;
  int original_, fixed_params_, fixed_start_;
};

}  // namespace pendula::lua

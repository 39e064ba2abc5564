// A sweep whose results are in a file.
#pragma once

#include "integrate/sweep/sweep.hpp"
#include "lua/core/call.hpp"
#include "random/sample_space.hpp"

namespace pendula::lua {

/// Model and options as text, and the hash that stands for them.
struct SweepText {
  std::string model, options;
  std::string hidden;  ///< places of the options that the text leaves out (Lua functions), or ""
  std::string fingerprint;
};
/// Of everything that the results depend on: the texts of the model and of the options, what
/// they leave out, and its contents.
std::string fingerprint_of(const std::string& model, const std::string& options,
                           const std::string& hidden = "", const std::string& contents = "");
/// Of arguments 1 and 2 of sweep, as they were given.
SweepText read_sweep_text(Call& call);

/// The description of a sweep in its store, written before its runs.
store::Description describe_store(const integrate::Sweep& sweep, const random::SampleSpace& space,
                                  const SweepText& text);

}  // namespace pendula::lua

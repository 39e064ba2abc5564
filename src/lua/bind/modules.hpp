// The bindings: one folder per layer of src, one file per subject, one Module (lua/core/call.hpp) per file.
//
//   expr       symbols, functions, matrices, calculus, evaluation
//   dae        models, structure, forms, consistent starts, pencils, Lagrangians
//   integrate  tableaus, methods, stability, integration, sweeps, the Newton laboratories
//   lti        linear systems, their analysis and responses; complex numbers
//   sysid      data, models, estimation, validation
//   plot       figures
//
// A binding reads arguments, calls its layer and pushes results; it computes nothing. What several folders
// read (inputs, functions to be traced, data sets) is in lua/read.
#pragma once

#include <vector>

#include "lua/core/call.hpp"

namespace pendula::lua {

/// Every module of the program; the order is the order of help(). A new module is one `extern` line and one
/// entry in modules.cpp.
const std::vector<const Module*>& modules();

}  // namespace pendula::lua

// Pareto fronts of error against time, and what follows from them: what to pick for a budget, and whether any
// model beats another. Pure functions.
#pragma once

#include <optional>
#include <string>
#include <vector>

namespace strandcast {

struct WorkPoint {
  std::string method;
  double us = 0.0;     // per strand and frame
  double error = 0.0;  // relative
  std::string label;   // the setting in words
};

/// Indices of the points that no other one is faster and at least as exact as, in ascending time; the error
/// falls along them. Points that are not finite are not on it.
std::vector<size_t> pareto_front(const std::vector<WorkPoint>& points);

/// The most exact point within the budget; nullopt when none is.
std::optional<size_t> best_within(const std::vector<WorkPoint>& points, double budget_us);

/// A point of another method that is faster and more exact than one on the champion's own front, which has an
/// error below `error_limit`.
struct Beaten {
  size_t winner = 0;
  size_t champion = 0;
};
std::optional<Beaten> find_beaten(const std::vector<WorkPoint>& points, const std::string& champion,
                                  double error_limit);

/// The answer in one or two sentences for a reader.
std::string beaten_sentence(const std::vector<WorkPoint>& points, const std::string& champion,
                            double error_limit);

}  // namespace strandcast

// Pareto fronts of error against time, and conclusions from them: the best choice for a budget, and whether
// any model beats another. Pure functions.
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

/// Returns the indices of the points that no other point beats in both time and error, in ascending time and
/// falling error. Points that are not finite are excluded.
std::vector<size_t> pareto_front(const std::vector<WorkPoint>& points);

/// Returns the most exact point within the budget; nullopt if there is none.
std::optional<size_t> best_within(const std::vector<WorkPoint>& points, double budget_us);

/// A point of another method that is faster and more exact than one on the champion's own front with an error
/// below `error_limit`.
struct Beaten {
  size_t winner = 0;
  size_t champion = 0;
};
std::optional<Beaten> find_beaten(const std::vector<WorkPoint>& points, const std::string& champion,
                                  double error_limit);

/// Returns the conclusion in one or two sentences for a reader.
std::string beaten_sentence(const std::vector<WorkPoint>& points, const std::string& champion,
                            double error_limit);

}  // namespace strandcast

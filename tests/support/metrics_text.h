// The text of /metrics, read strictly: Prometheus' exposition format 0.0.4, and the rules for names on top.
#pragma once

#include <cmath>
#include <map>
#include <regex>
#include <set>
#include <sstream>
#include <string>
#include <vector>

namespace strandcast::test {

struct MetricFamily {
  std::string type;
  std::vector<std::pair<std::string, double>> samples;  // whole name with labels
};

/// The families by name; `faults` gets a sentence for everything that is not right.
inline std::map<std::string, MetricFamily> read_metrics(const std::string& text,
                                                        std::vector<std::string>& faults) {
  static const std::regex kHelp("# HELP ([a-zA-Z_:][a-zA-Z0-9_:]*) (\\S.*)");
  static const std::regex kType("# TYPE ([a-zA-Z_:][a-zA-Z0-9_:]*) (counter|gauge|histogram)");
  static const std::string kLabel = R"([a-zA-Z_][a-zA-Z0-9_]*="(?:[^"\\\n]|\\[\\"n])*")";
  static const std::regex kSample("([a-zA-Z_:][a-zA-Z0-9_:]*)(\\{" + kLabel + "(," + kLabel +
                                  R"()*\})? ([-+]?(?:[0-9]+(?:\.[0-9]*)?(?:e[-+]?[0-9]+)?|Inf)|NaN))");
  std::map<std::string, MetricFamily> families;
  std::set<std::string> seen;
  std::string help_of, family;
  if (!text.ends_with('\n')) faults.push_back("the last line has no end");
  std::istringstream lines(text);
  for (std::string line; std::getline(lines, line);) {
    std::smatch part;
    if (std::regex_match(line, part, kHelp)) {
      help_of = part[1];
      family.clear();
    } else if (std::regex_match(line, part, kType)) {
      family = part[1];
      if (family != help_of) faults.push_back("no help right before: " + line);
      if (families.contains(family)) faults.push_back("twice: " + line);
      if ((part[2] == "counter") != family.ends_with("_total"))
        faults.push_back("counters end in _total: " + line);
      families[family].type = part[2];
    } else if (std::regex_match(line, part, kSample)) {
      const std::string name = part[1];
      const bool is_own = name == family && families[family].type != "histogram";
      const bool is_part =
          !family.empty() && families[family].type == "histogram" &&
          (name == family + "_bucket" || name == family + "_sum" || name == family + "_count");
      if (!is_own && !is_part) faults.push_back("outside its family: " + line);
      if (!seen.insert(name + part[2].str()).second) faults.push_back("twice: " + line);
      families[family].samples.emplace_back(name + part[2].str(), std::stod(part[4]));
    } else {
      faults.push_back("unreadable: " + line);
    }
  }
  return families;
}

/// Of one histogram, whose buckets come in their order.
struct BucketCheck {
  double last = 0.0, last_bound = -INFINITY, count = -1.0;
};

/// Faults of the values: negative counters, buckets that shrink or do not add up.
inline void check_metrics(const std::map<std::string, MetricFamily>& families,
                          std::vector<std::string>& faults) {
  static const std::regex kBound(R"re((.*_bucket)\{(.*,)?le="([^"]*)"\})re");
  for (const auto& [name, family] : families) {
    if (family.samples.empty()) faults.push_back("without a sample: " + name);
    std::map<std::string, BucketCheck> histograms;  // by their other labels
    for (const auto& [sample, value] : family.samples) {
      if (!std::isfinite(value)) faults.push_back("not finite: " + sample);
      if (family.type == "counter" && value < 0.0) faults.push_back("negative: " + sample);
      if (family.type != "histogram") continue;
      if (sample.starts_with(name + "_count")) {
        const std::string labels = sample.substr(name.size() + std::string("_count").size());
        histograms[labels.empty() ? labels : labels.substr(1, labels.size() - 2) + ","].count = value;
      }
      std::smatch part;
      if (!std::regex_match(sample, part, kBound)) continue;
      BucketCheck& check = histograms[part[2]];
      const double bound = std::stod(part[3]);
      if (bound <= check.last_bound || value < check.last) faults.push_back("out of order: " + sample);
      check.last_bound = bound;
      check.last = value;
    }
    for (const auto& [labels, check] : histograms)
      if (!std::isinf(check.last_bound) || check.count != check.last)
        faults.push_back("does not add up: " + name + "{" + labels + "}");
    if (family.type == "histogram" && histograms.empty()) faults.push_back("no buckets: " + name);
  }
}

/// What is wrong with this text; empty when nothing is.
inline std::vector<std::string> metric_faults(const std::string& text) {
  std::vector<std::string> faults;
  check_metrics(read_metrics(text, faults), faults);
  return faults;
}

}  // namespace strandcast::test

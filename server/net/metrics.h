// Prometheus text (exposition format 0.0.4): each metric with its help and type. Any thread.
#pragma once

#include <initializer_list>
#include <string>
#include <string_view>
#include <utility>

#include "common/base/histogram.h"
#include "server/net/net_server.h"

namespace strandcast {

/// `type` is "counter", whose name ends in _total, or "gauge"; `help` is one line.
std::string format_metric(std::string_view name, const char* type, const char* help, double value);

/// Buckets in milliseconds, their sum and their count.
std::string format_histogram(std::string_view name, const char* help, const Histogram& histogram);

/// A gauge that is 1, for what its labels say. Values may be any text.
std::string format_info(std::string_view name, const char* help,
                        std::initializer_list<std::pair<const char*, std::string>> labels);

/// Any text as it stands between the quotes of a label.
std::string label_value(std::string_view text);

/// What runs here: a gauge that is 1, with the version as a label.
std::string format_build_info(const char* version);

std::string format_metrics(const NetCounters& counters);

}  // namespace strandcast

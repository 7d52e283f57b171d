// SPDX-License-Identifier: Apache-2.0
// What a program counts and measures of itself, told in the text format that Prometheus reads.
// https://prometheus.io/docs/instrumenting/exposition_formats/
#pragma once

#include <functional>
#include <string>
#include <string_view>
#include <utility>
#include <vector>

namespace gyre {

// One value of a metric. Names of labels are letters, digits and '_'; their values may be any text.
struct MetricSample {
  std::vector<std::pair<std::string, std::string>> labels;
  double value = 0.0;
};

// Holds no values: each is asked for when somebody looks. All metrics are added before the first expose(), which may
// then be called from any thread; so may what is added here.
class Metrics {
 public:
  using ReadOne = std::function<double()>;
  using ReadAll = std::function<std::vector<MetricSample>()>;

  // What only grows while the program runs. name: with its unit and "_total" at the end, "gyre_received_bytes_total";
  // help: a sentence.
  void counter(const std::string& name, const std::string& help, ReadOne read);
  void counter(const std::string& name, const std::string& help, ReadAll read);
  // What goes up and down.
  void gauge(const std::string& name, const std::string& help, ReadOne read);
  void gauge(const std::string& name, const std::string& help, ReadAll read);

  // All metrics, in the order in which they were added.
  std::string expose() const;

  static constexpr const char* content_type = "text/plain; version=0.0.4; charset=utf-8";

 private:
  struct Family {
    std::string name, help;
    const char* type;
    ReadAll read;
  };
  void add(const std::string& name, const std::string& help, const char* type, ReadAll read);

  std::vector<Family> families_;
};

// Memory, processor time, open files, start and version of this process, under the names Prometheus knows.
void add_process_metrics(Metrics& metrics);

}  // namespace gyre

// SPDX-License-Identifier: Apache-2.0
#include "common/config/config.h"

#include <toml++/toml.h>
#include <CLI/CLI.hpp>

namespace gyre {

namespace {

std::string text_of(const toml::node& value) {
  if (const auto* text = value.as_string()) return text->get();
  std::ostringstream out;
  value.visit([&](const auto& v) {
    if constexpr (toml::is_value<decltype(v)>) out << v;
  });
  return out.str();
}

class TomlConfig : public CLI::Config {
 public:
  std::string to_config(const CLI::App*, bool, bool, std::string) const override { return {}; }

  std::vector<CLI::ConfigItem> from_config(std::istream& in) const override {
    std::vector<CLI::ConfigItem> found;
    try {
      append(toml::parse(in), {}, found);
    } catch (const toml::parse_error& e) {
      std::ostringstream where;
      where << e.description() << " at line " << e.source().begin.line;
      throw CLI::FileError("the configuration is not valid TOML: " + where.str());
    }
    return found;
  }

 private:
  static void append(const toml::table& table, const std::vector<std::string>& parents,
                     std::vector<CLI::ConfigItem>& found) {
    for (const auto& [key, value] : table) {
      if (const toml::table* inner = value.as_table()) {
        std::vector<std::string> path = parents;
        path.emplace_back(key.str());
        append(*inner, path, found);
        continue;
      }
      CLI::ConfigItem item;
      item.parents = parents;
      item.name = key.str();
      if (const toml::array* list = value.as_array()) {
        for (const toml::node& element : *list) item.inputs.push_back(text_of(element));
      } else {
        item.inputs.push_back(text_of(value));
      }
      found.push_back(std::move(item));
    }
  }
};

}  // namespace

void add_config_option(CLI::App& app, const std::string& fallback) {
  app.set_config("--config", fallback, "TOML file with the same names as the flags (a flag wins)");
  app.config_formatter(std::make_shared<TomlConfig>());
  app.allow_config_extras(CLI::config_extras_mode::error);
}

}  // namespace gyre

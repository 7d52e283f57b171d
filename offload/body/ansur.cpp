// SPDX-License-Identifier: Apache-2.0
#include "offload/body/ansur.h"

#include "common/bundle/atomic_file.h"

#include <charconv>

namespace gyre {
namespace {

struct Column {
  const char* name;
  double Person::*measure;
};
constexpr std::array<Column, 4> columns = {{{"stature", &Person::stature},
                                            {"waistcircumference", &Person::waist},
                                            {"chestcircumference", &Person::chest},
                                            {"buttockcircumference", &Person::buttock}}};

std::vector<std::string> split(const std::string& line) {
  std::vector<std::string> cells;
  std::istringstream stream(line);
  std::string cell;
  while (std::getline(stream, cell, ',')) {
    while (!cell.empty() && (cell.back() == '\r' || cell.back() == ' ')) cell.pop_back();
    cells.push_back(cell);
  }
  return cells;
}

double percentile(std::vector<double> values, double share) {
  const auto at = static_cast<std::ptrdiff_t>(share * static_cast<double>(values.size() - 1));
  std::nth_element(values.begin(), values.begin() + at, values.end());
  return values[at];
}

Result<Survey::Sex> read_table(const std::filesystem::path& file) {
  const Result<std::string> text = read_file(file);
  if (!text) return tl::unexpected(text.error());
  std::istringstream lines(*text);
  std::string line;
  std::getline(lines, line);
  const std::vector<std::string> header = split(line);
  std::array<std::size_t, columns.size()> at{};
  for (std::size_t c = 0; c < columns.size(); ++c) {
    at[c] = std::find(header.begin(), header.end(), columns[c].name) - header.begin();
    if (at[c] == header.size())
      return fail("table without column '" + std::string(columns[c].name) + "'", file.string());
  }
  Survey::Sex sex;
  for (int row = 2; std::getline(lines, line); ++row) {
    const std::vector<std::string> cells = split(line);
    Person person;
    for (std::size_t c = 0; c < columns.size(); ++c) {
      double millimetres = 0;
      const bool there = at[c] < cells.size();
      const char* end = there ? cells[at[c]].data() + cells[at[c]].size() : nullptr;
      if (!there || std::from_chars(cells[at[c]].data(), end, millimetres).ec != std::errc() || !(millimetres > 0))
        return fail("bad number", file.string() + " line " + std::to_string(row));
      person.*columns[c].measure = millimetres / 1000;
    }
    sex.people.push_back(person);
  }
  if (sex.people.size() < 100) return fail("table with too few people", file.string());
  for (const Column& column : columns) {
    std::vector<double> values;
    for (const Person& person : sex.people) values.push_back(person.*column.measure);
    sex.lowest.*column.measure = percentile(values, 0.01);
    sex.highest.*column.measure = percentile(values, 0.99);
  }
  for (const Person& person : sex.people) sex.mean_stature += person.stature / static_cast<double>(sex.people.size());
  return sex;
}

}  // namespace

Result<Survey> read_survey(const std::filesystem::path& folder) {
  Result<Survey::Sex> female = read_table(folder / "ansur2_female_measures.csv");
  if (!female) return tl::unexpected(female.error());
  Result<Survey::Sex> male = read_table(folder / "ansur2_male_measures.csv");
  if (!male) return tl::unexpected(male.error());
  return Survey{std::move(*female), std::move(*male)};
}

}  // namespace gyre

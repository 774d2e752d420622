// SPDX-License-Identifier: Apache-2.0
#include "tests/support/dicom_labels_writer.h"

#include <algorithm>
#include <cstdio>

namespace palpate::test {
namespace {

constexpr double kMmPerMetre = 1e3;

std::string digits(double value) {
    std::array<char, 40> text{};
    for (int count = 17; count > 0; --count)
        if (std::snprintf(text.data(), text.size(), "%.*g", count, value) <= 16) break;
    return text.data();
}

DicomDataSet described(const WrittenSegment& segment, unsigned number) {
    DicomDataSet item;
    item.us(0x00620004, {number});
    item.text(0x00620005, "LO", segment.name);
    item.text(0x00620008, "CS", "MANUAL");
    item.us(0x0062000D, {segment.lab[0], segment.lab[1], segment.lab[2]});
    return item;
}

/// One frame: its groups and its numbers.
struct Frame {
    DicomDataSet groups;
    std::vector<unsigned> pixels;
    bool is_empty = true;
};

Frame frame_of(const std::array<int, 3>& size, const AffineTransform& frame, int k,
               const std::function<unsigned(int, int, int)>& number) {
    Frame result;
    for (int j = 0; j < size[1]; ++j)
        for (int i = 0; i < size[0]; ++i)
            result.pixels.push_back(number(i, j, k));
    const Vec3 position = kMmPerMetre * frame.point(Vec3(0, 0, k));
    DicomDataSet plane;
    plane.decimals(0x00200032, {position.x, position.y, position.z});
    result.groups.sequence(0x00209113, {plane});
    return result;
}

DicomDataSet shared_groups(const AffineTransform& frame, const SegmentationForm& form) {
    const Vec3 along_i = glm::normalize(frame.linear[0]), along_j = glm::normalize(frame.linear[1]);
    DicomDataSet orientation, measures, shared;
    orientation.decimals(0x00200037,
                         {along_i.x, along_i.y, along_i.z, along_j.x, along_j.y, along_j.z});
    if (form.thickness > 0.0) measures.decimals(0x00180050, {form.thickness});
    if (form.stated_step > 0.0) measures.decimals(0x00180088, {form.stated_step});
    measures.decimals(0x00280030, {kMmPerMetre * glm::length(frame.linear[1]),
                                   kMmPerMetre * glm::length(frame.linear[0])});
    shared.sequence(0x00209116, {orientation});
    shared.sequence(0x00289110, {measures});
    return shared;
}

/// Bits follow each other over the ends of frames, the lowest of a byte first.
std::string packed(const std::vector<Frame>& frames, SegmentationForm::Type type) {
    std::string bytes;
    std::size_t bit = 0;
    for (const Frame& frame : frames)
        for (const unsigned pixel : frame.pixels) {
            if (type != SegmentationForm::Type::binary) {
                bytes += static_cast<char>(pixel);
                continue;
            }
            if (bit % 8 == 0) bytes += '\0';
            if (pixel != 0)
                bytes.back() =
                    static_cast<char>(static_cast<unsigned char>(bytes.back()) | 1U << bit % 8);
            ++bit;
        }
    if (bytes.size() % 2 != 0) bytes += '\0';
    return bytes;
}

} // namespace

DicomDataSet dicom_segmentation(const std::array<int, 3>& size, const AffineTransform& frame,
                                const std::vector<WrittenSegment>& segments,
                                const SegmentationForm& form) {
    using Type = SegmentationForm::Type;
    std::vector<DicomDataSet> descriptions;
    for (std::size_t n = 0; n < segments.size(); ++n)
        descriptions.push_back(described(segments[n], static_cast<unsigned>(n) + 1));
    std::vector<Frame> frames;
    const auto add = [&](unsigned segment, const std::function<unsigned(int, int, int)>& number,
                         const std::function<bool(int, int, int)>& counts) {
        for (int n = 0; n < size[2]; ++n) {
            const int k = form.backwards ? size[2] - 1 - n : n;
            Frame one = frame_of(size, frame, k, number);
            for (int j = 0; j < size[1]; ++j)
                for (int i = 0; i < size[0]; ++i)
                    one.is_empty = one.is_empty && !counts(i, j, k);
            DicomDataSet identification;
            identification.us(0x0062000B, {segment});
            if (segment > 0) one.groups.sequence(0x0062000A, {identification});
            if (form.keeps_empty_frames || !one.is_empty) frames.push_back(std::move(one));
        }
    };
    if (form.type == Type::label_map) {
        const auto number = [&](int i, int j, int k) {
            for (std::size_t n = 0; n < segments.size(); ++n)
                if (segments[n].is_inside(i, j, k)) return static_cast<unsigned>(n) + 1;
            return 0U;
        };
        add(0, number, [&](int i, int j, int k) { return number(i, j, k) > 0; });
    } else {
        for (std::size_t n = 0; n < segments.size(); ++n)
            add(
                static_cast<unsigned>(n) + 1,
                [&](int i, int j, int k) {
                    const bool is_inside = segments[n].is_inside(i, j, k);
                    if (form.type == Type::binary) return is_inside ? 1U : 0U;
                    return is_inside ? form.greatest_share : form.greatest_share / 2 - 1;
                },
                segments[n].is_inside);
    }
    DicomDataSet file;
    file.text(0x00080005, "CS", "ISO_IR 192");
    file.text(0x00080016, "UI",
              form.type == Type::label_map ? "1.2.840.10008.5.1.4.1.1.66.7"
                                           : "1.2.840.10008.5.1.4.1.1.66.4");
    file.text(0x00080018, "UI", "1.2.826.0.1.3680043.10.54.66");
    file.text(0x00080060, "CS", "SEG");
    file.text(0x00100010, "PN", "Nobody^Generated");
    file.text(0x0020000E, "UI", "1.2.826.0.1.3680043.10.54.66.1");
    file.us(0x00280002, {1});
    file.text(0x00280004, "CS", "MONOCHROME2");
    file.text(0x00280008, "IS", std::to_string(frames.size()));
    file.us(0x00280010, {static_cast<unsigned>(size[1])});
    file.us(0x00280011, {static_cast<unsigned>(size[0])});
    const unsigned bits = form.type == Type::binary ? 1 : 8;
    file.us(0x00280100, {bits});
    file.us(0x00280101, {bits});
    file.us(0x00280102, {bits - 1});
    file.us(0x00280103, {0});
    static constexpr std::array<const char*, 3> kTypes{"BINARY", "FRACTIONAL", "LABELMAP"};
    file.text(0x00620001, "CS", kTypes[static_cast<std::size_t>(form.type)]);
    file.sequence(0x00620002, descriptions);
    if (form.type == Type::fractional) file.us(0x0062000E, {form.greatest_share});
    file.sequence(0x52009229, {shared_groups(frame, form)});
    std::vector<DicomDataSet> groups;
    for (const Frame& one : frames)
        groups.push_back(one.groups);
    file.sequence(0x52009230, groups);
    file.elements[0x7FE00010] = {"OB", packed(frames, form.type), {}, {}};
    return file;
}

DicomDataSet dicom_structures(const std::vector<WrittenStructure>& structures,
                              const std::string& series_uid) {
    DicomDataSet file, series, study, frame;
    series.text(0x0020000E, "UI", series_uid);
    study.sequence(0x30060014, {series});
    frame.text(0x00200052, "UI", "1.2.826.0.1.3680043.10.54.52");
    frame.sequence(0x30060012, {study});
    file.text(0x00080016, "UI", "1.2.840.10008.5.1.4.1.1.481.3");
    file.text(0x00080018, "UI", "1.2.826.0.1.3680043.10.54.481");
    file.text(0x00080060, "CS", "RTSTRUCT");
    file.text(0x00100010, "PN", "Nobody^Generated");
    file.text(0x0020000E, "UI", "1.2.826.0.1.3680043.10.54.481.1");
    file.sequence(0x30060010, {frame});
    std::vector<DicomDataSet> names, all;
    for (const WrittenStructure& structure : structures) {
        DicomDataSet name, item;
        name.text(0x30060022, "IS", std::to_string(structure.number));
        name.text(0x30060026, "LO", structure.name);
        names.push_back(name);
        item.text(0x3006002A, "IS", structure.color);
        std::vector<DicomDataSet> contours;
        for (const std::vector<Vec3>& corners : structure.contours) {
            std::string numbers;
            for (const Vec3& p : corners)
                for (int axis = 0; axis < 3; ++axis)
                    numbers += (numbers.empty() ? "" : "\\") + digits(p[axis]);
            DicomDataSet contour;
            contour.text(0x30060042, "CS", structure.type);
            contour.text(0x30060046, "IS", std::to_string(corners.size()));
            contour.text(0x30060050, "DS", numbers);
            contours.push_back(contour);
        }
        item.sequence(0x30060040, contours);
        item.text(0x30060084, "IS", std::to_string(structure.number));
        all.push_back(item);
    }
    file.sequence(0x30060020, names);
    file.sequence(0x30060039, all);
    return file;
}

} // namespace palpate::test

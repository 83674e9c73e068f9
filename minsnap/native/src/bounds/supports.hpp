// Support functions of the sets in which accelerations and velocities stay, with norms rounded from above: (n^2 + w^2)^(1/2) for n.
#pragma once

#include <cmath>

namespace minsnap {

// A convex function of three coordinates at a place.
struct Convex {
    double value = 0.0, slope[3] = {}, curve[3][3] = {};

    // Add |A x| for rows A of which each is a multiple of a coordinate, or their sum along a vector: the root of x' M x + w^2.
    void add_root(const double (&product)[3], double squared, const double (&metric)[3][3], double width) {
        const double root = std::sqrt(squared + width * width);
        value += root;
        if (!(root > 0.0)) return;
        for (int i = 0; i < 3; ++i) slope[i] += product[i] / root;
        for (int i = 0; i < 3; ++i)
            for (int j = 0; j < 3; ++j) curve[i][j] += (metric[i][j] - product[i] * product[j] / (root * root)) / root;
    }

    // Add the norm of rows (3, 3) times x.
    void add_mapped(const double *rows, const double *x, double width) {
        double squared = 0.0, product[3] = {}, metric[3][3] = {};
        for (int r = 0; r < 3; ++r) {
            const double *const row = rows + 3 * r, along = row[0] * x[0] + row[1] * x[1] + row[2] * x[2];
            squared += along * along;
            for (int i = 0; i < 3; ++i) {
                product[i] += along * row[i];
                for (int j = 0; j < 3; ++j) metric[i][j] += row[i] * row[j];
            }
        }
        add_root(product, squared, metric, width);
    }

    // Add the absolute value of a product with a vector.
    void add_absolute(const double *vector, const double *x, double width) {
        double along = 0.0, product[3], metric[3][3];
        for (int i = 0; i < 3; ++i) along += vector[i] * x[i];
        for (int i = 0; i < 3; ++i) {
            product[i] = along * vector[i];
            for (int j = 0; j < 3; ++j) metric[i][j] = vector[i] * vector[j];
        }
        add_root(product, along * along, metric, width);
    }

    // Add a factor times the norm of the coordinates of which bits are set.
    void add_norm(int axes, double factor, const double *x, double width) {
        double squared = 0.0, product[3] = {}, metric[3][3] = {};
        for (int i = 0; i < 3; ++i) {
            if (!(axes >> i & 1)) continue;
            product[i] = factor * factor * x[i];
            metric[i][i] = factor * factor;
            squared += product[i] * x[i];
        }
        add_root(product, squared, metric, width);
    }
};

// Balls and intervals over coordinates that belong together, or a cone about the third axis cut at a height.
struct SupportSet {
    double kind;       // 0, or 1 for the cone
    double center[3];  // or the tip of the cone
    double group[3];   // to which each coordinate belongs, or -1
    double radius[3];  // of each group
    double slope, height;

    int axes(int of) const {
        int bits = 0;
        for (int i = 0; i < 3; ++i) bits |= int(group[i]) == of ? 1 << i : 0;
        return bits;
    }
    int covered() const { return kind > 0.0 ? 7 : axes(0) | axes(1) | axes(2); }

    // Over how many roots a width is spread.
    int roots() const { return kind > 0.0 ? 2 : (axes(0) != 0) + (axes(1) != 0) + (axes(2) != 0); }

    void add(const double *x, double width, Convex &sum) const {
        for (int i = 0; i < 3; ++i) sum.value += center[i] * x[i], sum.slope[i] += center[i];
        if (kind > 0.0) return add_cone(x, width, sum);
        for (int g = 0; g < 3; ++g)
            if (const int bits = axes(g)) sum.add_norm(bits, radius[g], x, width);
    }

private:
    // The height times what is positive of x_3 + slope |(x_1, x_2)|.
    void add_cone(const double *x, double width, Convex &sum) const {
        Convex inner;
        inner.add_norm(3, slope, x, width / height);
        inner.value += x[2];
        inner.slope[2] += 1.0;
        const double round = width / height, u = inner.value, root = std::sqrt(u * u + round * round);
        sum.value += 0.5 * height * (u + root);
        if (!(root > 0.0)) return;
        const double first = 0.5 * height * (1.0 + u / root), second = 0.5 * height * round * round / (root * root * root);
        for (int i = 0; i < 3; ++i) {
            sum.slope[i] += first * inner.slope[i];
            for (int j = 0; j < 3; ++j) sum.curve[i][j] += first * inner.curve[i][j] + second * inner.slope[i] * inner.slope[j];
        }
    }
};

}  // namespace minsnap

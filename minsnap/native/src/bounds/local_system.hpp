// The few unknowns of one instant or cell: those that nothing else shares are eliminated at once, and found again after the others.
#pragma once

namespace minsnap {

template <int most>
struct LocalSystem {
    int own = 0, size = 0;  // unknowns that are eliminated, which come first, and all
    double matrix[most][most], right[most];

    // Clear it, with room for one unknown more.
    void begin(int eliminated, int count) {
        own = eliminated, size = count;
        for (int i = 0; i <= size && i < most; ++i) {
            right[i] = 0.0;
            for (int j = 0; j <= size && j < most; ++j) matrix[i][j] = 0.0;
        }
    }

    // Add a symmetric block of three at two places, and its mirror image.
    void add(int row, int column, double factor, const double (&block)[3][3]) {
        for (int i = 0; i < 3; ++i)
            for (int j = 0; j < 3; ++j) {
                matrix[row + i][column + j] += factor * block[i][j];
                if (row != column) matrix[column + j][row + i] += factor * block[i][j];
            }
    }

    // Hold an own unknown at zero.
    void hold(int place) {
        for (int k = 0; k < size; ++k) matrix[place][k] = matrix[k][place] = 0.0;
        matrix[place][place] = 1.0;
        right[place] = 0.0;
    }

    void eliminate(double trifle) {
        for (int j = 0; j < own; ++j) {
            matrix[j][j] += trifle;
            for (int i = j + 1; i < size; ++i) {
                const double share = matrix[i][j] / matrix[j][j];
                for (int c = j + 1; c < size; ++c) matrix[i][c] -= share * matrix[j][c];
                right[i] -= share * right[j];
            }
        }
    }

    // Find the own unknowns of ``x``, whose others are known; returns what they promise alone.
    double substitute(double *x, double *found) const {
        double promised = 0.0;
        for (int j = own - 1; j >= 0; --j) {
            x[j] = right[j];
            for (int c = j + 1; c < size; ++c) x[j] -= matrix[j][c] * x[c];
            x[j] /= matrix[j][j];
            found[j] = x[j];
            promised += right[j] * right[j] / matrix[j][j];
        }
        return promised;
    }
};

}  // namespace minsnap

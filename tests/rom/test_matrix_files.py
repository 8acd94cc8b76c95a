"""Matrices of other programs: each format read and written, broken files refused with one line."""

from pathlib import Path

import h5py
import numpy as np
import pytest
from pyyeti.nastran import op4
from scipy.io import loadmat, mmread, mmwrite, savemat
from scipy.sparse import coo_matrix, csc_matrix, random, tril

from rom import MatrixFileError, read_matrix
from rom.matrix_files.labelled_matrix import MASS, STIFFNESS
from rom.matrix_files.matrix_file import write_matrices
from rom.matrix_files.node_table import read_dofs, read_nodes

N = 12


@pytest.fixture(scope="module")
def stiffness():
    """A sparse symmetric positive definite matrix with numbers of all sizes."""
    half = random(N, N, 0.3, random_state=3, format="csr")
    return (half @ half.T + 1e6 * csc_matrix(np.diag(np.arange(1.0, N + 1)))).tocsr()


def lines_of(matrix, form):
    entries = tril(matrix).tocoo()
    return [form(i + 1, j + 1, value) for i, j, value in zip(entries.row, entries.col, entries.data, strict=True)]


def write_ansys_free_formats(folder, matrix):
    """The matrix in every text format, each written here by hand."""
    node, dof = np.divmod(np.arange(N), 3)
    folder = Path(folder)
    sti = lines_of(matrix, lambda i, j, value: f"{j} {i} {value:.17e}")
    (folder / "k.sti").write_text("\n".join(sti))
    (folder / "k.dof").write_text("\n".join(f"{a + 1}.{b + 1}" for a, b in zip(node, dof, strict=True)))
    five = "{}, {}, {}, {}, {:.17e}"
    abaqus = lines_of(
        matrix,
        lambda i, j, value: five.format(node[i - 1] + 1, dof[i - 1] + 1, node[j - 1] + 1, dof[j - 1] + 1, value),
    )
    (folder / "abaqus.mtx").write_text("** a comment\n*MATRIX INPUT, NAME=K\n" + "\n".join(abaqus))
    (folder / "coordinate.mtx").write_text("\n".join(lines_of(matrix, "{}, {}, {:.17e}".format)))


def dmig(matrix, form, write):
    """DMIG entries of a matrix, columns in their order; `write` formats a column."""
    full = matrix.toarray()
    text = [f"DMIG    KAA            0{form:8d}       2       0"]
    for column in range(N):
        rows = [row for row in range(column if form == 6 else 0, N) if full[row, column]]
        text.append(write(column, [(row, full[row, column]) for row in rows]))
    return "\n".join(text) + "\n"


def large_field(column, rows):
    lines = [f"DMIG*   {'KAA':16s}{column // 3 + 1:16d}{column % 3 + 1:16d}"]
    for row, value in rows:
        number = f"{value:.9e}".replace("e", "D")
        lines.append(f"*       {row // 3 + 1:16d}{row % 3 + 1:16d}{number:>16s}")
    return "\n".join(lines)


def free_field(column, rows):
    text = f"DMIG,KAA,{column // 3 + 1},{column % 3 + 1}"
    for place, (row, value) in enumerate(rows):
        text += ("," if place == 0 else "\n") + f",{row // 3 + 1},{row % 3 + 1},{value:.14e},"
    return text


def write_hdf5(path, matrix, header=True):
    """A sparse matrix and a full one as MATLAB 7.3 stores them."""
    columns = csc_matrix(matrix)
    with h5py.File(path, "w", userblock_size=512) as file:
        group = file.create_group("K")
        group.attrs["MATLAB_sparse"] = np.uint64(N)
        group["data"], group["ir"], group["jc"] = columns.data, columns.indices, columns.indptr
        file["Kfull"] = matrix.toarray().T
    if header:
        with open(path, "r+b") as raw:
            raw.write(b"MATLAB 7.3 MAT-file".ljust(124) + b"\x00\x02IM")


def written(folder, matrix):
    """Files of all formats with what `read_matrix` needs to be told, and the digits that they keep."""
    write_ansys_free_formats(folder, matrix)
    mmwrite(folder / "k.mtx", matrix, symmetry="symmetric", precision=17)
    mmwrite(folder / "dense.mtx", matrix.toarray(), symmetry="general", precision=17)
    mmwrite(folder / "half.mtx", tril(matrix), symmetry="general", precision=17)
    savemat(folder / "k.mat", {"K": csc_matrix(matrix), "other": np.eye(2)})
    savemat(folder / "full.mat", {"a_name": matrix.toarray()})
    write_hdf5(folder / "new.mat", matrix)
    op4.write(str(folder / "big.op4"), ["KAA", "MAA"], [matrix.toarray()] * 2, endian=">")
    op4.write(str(folder / "text.op4"), ["kgg"], [coo_matrix(matrix)], binary=False, digits=16, sparse="bigmat")
    (folder / "six.pch").write_text(dmig(matrix, 6, large_field))
    (folder / "one.dmig").write_text(dmig(matrix, 1, free_field))
    exact = {"k.sti", "abaqus.mtx", "coordinate.mtx", "k.mtx", "dense.mtx", "half.mtx", "k.mat", "full.mat"}
    return {
        **dict.fromkeys((*sorted(exact), "new.mat", "big.op4", "text.op4"), (None, 1e-15)),
        "six.pch": (None, 1e-9),
        "one.dmig": (None, 1e-13),
    }


def test_every_format_gives_the_same_matrix(stiffness, tmp_path):
    for name, (matrix_name, tolerance) in written(tmp_path, stiffness).items():
        found = read_matrix(tmp_path / name, matrix_name)
        error = abs(found.matrix - stiffness).max() / abs(stiffness).max()
        assert error <= tolerance, name
        labelled = name in ("k.sti", "abaqus.mtx", "six.pch", "one.dmig")
        assert (found.labels is not None) == labelled, name
        if labelled:
            assert found.labels.pairs.tolist() == [[k // 3 + 1, k % 3 + 1] for k in range(N)], name
    assert "completed by symmetry" in read_matrix(tmp_path / "half.mtx").notes[0]
    assert abs(read_matrix(tmp_path / "new.mat", "Kfull").matrix - stiffness).max() == 0.0


@pytest.mark.parametrize("suffix", [".pch", ".op4"])
def test_matrices_of_an_external_superelement_of_nastran(stiffness, tmp_path, suffix):
    """EXTSEOUT calls them KAAX and MAAX, beside those of damping."""
    path = tmp_path / f"ext{suffix}"
    if suffix == ".pch":
        named = [dmig(factor * stiffness, 6, large_field).replace("KAA ", name) for factor, name in
                 ((1.0, "KAAX"), (2.0, "MAAX"), (3.0, "BAAX"))]  # fmt: skip
        path.write_text("\n".join(named))
    else:
        op4.write(str(path), ["BAAX", "KAAX", "MAAX"], [factor * stiffness.toarray() for factor in (3.0, 1.0, 2.0)])
    for factor, usual in ((1.0, STIFFNESS), (2.0, MASS)):
        found = read_matrix(path, None, usual).matrix
        assert abs(found - factor * stiffness).max() <= 1e-9 * abs(stiffness).max()


def test_continuations_of_dmig_with_names(stiffness, tmp_path):
    """A large field may name its continuations: *A1 goes on as * does."""
    plain = dmig(stiffness, 6, large_field)
    (tmp_path / "k.pch").write_text(plain.replace("\n*       ", "\n*A1     "))
    assert abs(read_matrix(tmp_path / "k.pch").matrix - stiffness).max() <= 1e-9 * abs(stiffness).max()
    for line, said in (
        ("=,=,*(1),==", "a replicated entry: =,"),
        ("DMIG,KAA,1,1,,1,1,1.,,2,1,.5", "more than 10 fields"),
    ):
        (tmp_path / "k.pch").write_text(plain + line + "\n")
        with pytest.raises(MatrixFileError, match=said):
            read_matrix(tmp_path / "k.pch")


def test_reading_op4_leaves_numpy_as_it_was(stiffness, tmp_path):
    op4.write(str(tmp_path / "k.op4"), ["K"], [stiffness.toarray()])
    with np.printoptions(linewidth=77, precision=5):
        read_matrix(tmp_path / "k.op4")
        assert np.get_printoptions()["linewidth"] == 77
        assert np.get_printoptions()["precision"] == 5


def test_constrained_dofs_of_abaqus_are_left_out(tmp_path):
    (tmp_path / "k.mtx").write_text("1,1,1,1,2.\n1,2,1,2,1e36\n2,1,1,1,-1.\n2,1,2,1,1.\n")
    found = read_matrix(tmp_path / "k.mtx")
    assert found.matrix.toarray().tolist() == [[2.0, -1.0], [-1.0, 1.0]]
    assert found.labels.pairs.tolist() == [[1, 1], [2, 1]]
    assert "1 constrained" in found.notes[0]


def test_full_file_of_ansys():
    """The example file that comes with the reader: three dofs a node, rigid translations without force."""
    reader = pytest.importorskip("ansys.mapdl.reader")
    path = Path(reader.__file__).parent / "examples" / "file.full"
    if not path.is_file():
        pytest.skip("the reader comes without its example")
    found = read_matrix(path)
    mass = read_matrix(path, None, ("M",))
    n = found.matrix.shape[0]
    assert found.labels.pairs.tolist() == mass.labels.pairs.tolist()
    assert abs(found.matrix - found.matrix.T).max() <= 1e-12 * abs(found.matrix).max()
    for axis in (1, 2, 3):
        rigid = (found.labels.component == axis).astype(float)
        force = np.abs(found.matrix @ rigid)
        assert np.median(force) < 1e-8 * found.matrix.diagonal().max()
        assert 0.0 < rigid @ mass.matrix @ rigid < np.inf
    assert n == len(found.labels) > 900


@pytest.mark.parametrize("file_format", ["matrix-market", "abaqus", "op4", "mat", "mat-7.3"])
def test_written_matrices_are_read_by_other_libraries(stiffness, tmp_path, file_format):
    dense, force = stiffness.toarray(), np.arange(float(N))
    suffix = {"op4": "op4", "mat": "mat", "mat-7.3": "mat"}.get(file_format, "mtx")
    files = write_matrices(tmp_path / f"r.{suffix}", {"K": dense, "F": force}, file_format)
    if file_format == "matrix-market":
        assert np.array_equal(mmread(files[0]).toarray(), dense)
        assert np.array_equal(mmread(files[1]).toarray().ravel(), force)
    elif file_format == "abaqus":
        assert [file.name for file in files] == ["r_K.mtx"]
        table = np.loadtxt(files[0], delimiter=",", skiprows=2)
        lower = coo_matrix((table[:, 4], (table[:, 0].astype(int) - 1, table[:, 2].astype(int) - 1))).toarray()
        assert np.array_equal(lower, np.tril(dense))
    elif file_format == "op4":
        found = op4.load(str(files[0]))
        assert np.array_equal(found["k"][0], dense)
        assert found["k"][1] == 6
        assert np.array_equal(found["f"][0].ravel(), force)
    elif file_format == "mat":
        assert np.array_equal(loadmat(files[0])["K"], dense)
    else:
        assert files[0].read_bytes()[:10] == b"MATLAB 7.3"
        with h5py.File(files[0]) as file:
            assert np.array_equal(file["K"][()].T, dense)
            assert file["K"].attrs["MATLAB_class"] == b"double"
            assert file["F"].shape == (1, N)
    assert abs(read_matrix(files[0], "K" if suffix in ("op4", "mat") else None).matrix - stiffness).max() == 0.0


MARKET = "%%MatrixMarket matrix coordinate {} {}\n2 2 3\n1 1 2.0{}\n2 1 -1.0{}\n2 2 {}\n"
BROKEN = {
    "wide.mtx": ("%%MatrixMarket matrix coordinate real general\n2 3 2\n1 1 1.0\n2 3 1.0\n", "2 x 3"),
    "asymmetric.mtx": (
        "%%MatrixMarket matrix coordinate real general\n2 2 4\n1 1 2\n1 2 1\n2 1 -1\n2 2 2\n",
        "not symmetric, off by 1",
    ),
    "nan.mtx": (MARKET.format("real", "symmetric", "", "", "nan"), "not finite"),
    "inf.mtx": (MARKET.format("real", "symmetric", "", "", "inf"), "not finite"),
    "huge.mtx": (MARKET.format("real", "symmetric", "", "", "1e200"), "1e\\+200"),
    "complex.mtx": (MARKET.format("complex", "symmetric", " 1.0", " 1.0", "2.0 0.0"), "kind complex"),
    "pattern.mtx": ("%%MatrixMarket matrix coordinate pattern symmetric\n1 1 1\n1 1\n", "kind pattern"),
    "skew.mtx": ("%%MatrixMarket matrix coordinate real skew-symmetric\n2 2 1\n2 1 1.0\n", "skew-symmetric"),
    "short.mtx": ("%%MatrixMarket matrix coordinate real general\n2 2 3\n1 1 1.0\n", "not readable"),
    "claims.mtx": ("%%MatrixMarket matrix coordinate real general\n99999999 99999999 1\n1 1 1.0\n", "claims"),
    "header.mtx": ("%%MatrixMarket matrix\n", "not readable|claims"),
    "none.mtx": ("%%MatrixMarket matrix coordinate real general\n2 2 0\n", "without entries"),
    "empty.mtx": ("", "empty file"),
    "words.mtx": ("1, 1, 1, 1, stiff\n", "text where numbers"),
    "four.mtx": ("1, 1, 1, 1\n", "4 numbers"),
    "halves.mtx": ("1,1,1,1,2.\n1,1,2,1,3.\n2,1,1,1,4.\n2,1,2,1,2.\n", "two different values"),
    "cut.sti": ("1 1 2.0\n1 2", "cut off"),
    "row.sti": ("0 1 2.0\n", "no numbers from 1"),
    "text.sti": ("stiffness\n", "text where numbers"),
    "binary.sti": (b"\xff\xfe\x00\x01", "not a text file"),
    "complex.pch": ("DMIG    KAA            0       6       4       0\n", "complex"),
    "form2.pch": ("DMIG    KAA            0       2       2       0\n", "form 2"),
    "late.pch": ("DMIG,KAA,1,1,,1,1,2.0\n", "before its header"),
    "no.pch": ("GRID,1,,0.,0.,0.\n", "no matrix"),
    "number.pch": ("DMIG,KAA,0,6,2,0\nDMIG,KAA,1,1,,1,1,two\n", "cannot be read"),
    "half.pch": ("DMIG,KAA,0,1,2,0\nDMIG,KAA,1,1,,1,1,2.0\n,2,1,-1.0\nDMIG,KAA,2,1,,2,1,1.0\n", "one half only"),
    "k.mat": (b"MATLAB 5.0 MAT-file" + bytes(30), "not readable as MATLAB"),
    "k.full": (b"\x00" * 400, "not readable as an Ansys file"),
    "k.op4": (b"\x18\x00\x00\x00" + b"\x07" * 40, "OP4|cut off|claims|not readable"),
    "k.txt": ("1", 'ends with ".txt"'),
}


@pytest.mark.parametrize("name", BROKEN)
def test_a_broken_matrix_is_refused_with_one_line(name, tmp_path):
    content, said = BROKEN[name]
    path = tmp_path / name
    path.write_bytes(content if isinstance(content, bytes) else content.encode())
    with pytest.raises(MatrixFileError, match=said) as caught:
        read_matrix(path)
    assert str(caught.value).startswith(f"{path}: ")
    assert ", allowed: " in str(caught.value)
    assert "\n" not in str(caught.value)


def test_a_name_that_the_file_does_not_have_is_refused_with_those_that_it_has(stiffness, tmp_path):
    savemat(tmp_path / "k.mat", {"Kff": stiffness, "Mff": stiffness})
    write_hdf5(tmp_path / "new.mat", stiffness)
    op4.write(str(tmp_path / "k.op4"), ["KFF", "MFF"], [stiffness.toarray()] * 2)
    for name, held in (("k.mat", "Kff, Mff"), ("new.mat", "K, Kfull"), ("k.op4", "kff, mff")):
        with pytest.raises(MatrixFileError, match=f"'stiff'.*{held}"):
            read_matrix(tmp_path / name, "stiff")
    with pytest.raises(MatrixFileError, match="not clear"):
        read_matrix(tmp_path / "k.mat")
    assert read_matrix(tmp_path / "k.mat", "KFF").matrix.shape == (N, N)
    savemat(tmp_path / "c.mat", {"K": 1j * np.eye(2)})
    savemat(tmp_path / "s.mat", {"K": {"a": 1.0}})
    for name, said in (("c.mat", "complex"), ("s.mat", "no numbers|no matrix|holds")):
        with pytest.raises(MatrixFileError, match=said):
            read_matrix(tmp_path / name)


@pytest.mark.parametrize("share", [0.05, 0.3, 0.9])
def test_a_file_that_is_cut_off_is_refused(stiffness, tmp_path, share):
    op4.write(str(tmp_path / "k.op4"), ["K"], [stiffness.toarray()])
    savemat(tmp_path / "k.mat", {"K": stiffness.toarray()})
    write_hdf5(tmp_path / "new.mat", stiffness, header=False)
    for name in ("k.op4", "k.mat", "new.mat"):
        content = (tmp_path / name).read_bytes()
        (tmp_path / name).write_bytes(content[: int(share * len(content))])
        with pytest.raises(MatrixFileError) as caught:
            read_matrix(tmp_path / name)
        assert "\n" not in str(caught.value)


TABLES = {
    "no z": ("node,x,y\n1,0,0\n", "no column z"),
    "a word": ("node,x,y,z\n1,0,zero,0\n", "y in row 1 is 'zero'"),
    "nan": ("node,x,y,z\n1,0,nan,0\n", "y in row 1"),
    "twice": ("node,x,y,z\n1,0,0,0\n1,0,0,1\n", "node 1 is given twice"),
    "half a node": ("node,x,y,z\n1.5,0,0,0\n", "whole number"),
    "fields": ("node,x,y,z\n1,0,0\n", "line 2 has 3 fields"),
    "unknown": ("node,x,y,z,mass\n1,0,0,0,1\n", "'mass'"),
    "normals": ("node,x,y,z,nx,ny\n1,0,0,0,1,0\n", "only the columns nx, ny"),
    "zero normal": ("node,x,y,z,nx,ny,nz\n1,0,0,0,0,0,0\n", "length 0"),
    "area": ("node,x,y,z,area\n1,0,0,0,-1\n", "not above 0"),
    "axes": ("node,x,y,z,e1x,e1y,e1z,e2x,e2y,e2z\n1,0,0,0,1,0,0,1,0,0\n", "two axes at right angles"),
    "empty": ("", "empty table"),
    "no nodes": ("node,x,y,z\n", "no nodes"),
}


@pytest.mark.parametrize("case", TABLES)
def test_a_broken_table_of_nodes_is_refused_with_one_line(case, tmp_path):
    text, said = TABLES[case]
    (tmp_path / "nodes.csv").write_text(text)
    with pytest.raises(MatrixFileError, match=said) as caught:
        read_nodes(tmp_path / "nodes.csv")
    assert "\n" not in str(caught.value)


def test_tables_are_read_as_spreadsheets_write_them(tmp_path):
    (tmp_path / "n.csv").write_bytes("\ufeff# of a model\r\nnode;x;y;z;sets\r\n7;1;2;3;a b\r\n8;1;2;4;\r\n".encode())
    nodes = read_nodes(tmp_path / "n.csv")
    assert nodes.labels.tolist() == [7, 8]
    assert {name: rows.tolist() for name, rows in nodes.sets.items()} == {"a": [0], "b": [0]}
    (tmp_path / "d.csv").write_text("node,component\n7,UX\n7,y\n7,6\n,0\n")
    assert read_dofs(tmp_path / "d.csv").pairs.tolist() == [[7, 1], [7, 2], [7, 6], [0, 0]]
    for text, said in (
        ("node,component\n7,w\n", "'w'"),
        ("node,component\n7,1\n7,x\n", "given twice"),
        ("row,node,component\n1,7,1\n3,7,2\n", "each number once"),
    ):
        (tmp_path / "d.csv").write_text(text)
        with pytest.raises(MatrixFileError, match=said):
            read_dofs(tmp_path / "d.csv")


def test_a_file_that_claims_more_than_it_holds_is_refused_before_it_fills_the_memory(tmp_path):
    savemat(tmp_path / "k.mat", {"K": np.zeros((40, 40))})
    content = bytearray((tmp_path / "k.mat").read_bytes())
    shape = content.index(np.array([40, 40], dtype="<i4").tobytes())
    content[shape : shape + 8] = np.array([1_000_000, 1_000_000], dtype="<i4").tobytes()
    (tmp_path / "k.mat").write_bytes(content)
    with pytest.raises(MatrixFileError, match="claims 1000000 x 1000000"):
        read_matrix(tmp_path / "k.mat")
    with h5py.File(tmp_path / "h.mat", "w") as file:
        file.create_dataset("K", shape=(200_000, 200_000), dtype=float, chunks=(1000, 1000))
    with pytest.raises(MatrixFileError, match="claims"):
        read_matrix(tmp_path / "h.mat")
    for name, shape in (("wide.mat", 10**12), ("deep.mat", -5)):
        with h5py.File(tmp_path / name, "w") as file:
            group = file.create_group("K")
            group.attrs["MATLAB_sparse"] = np.int64(shape)
            group["data"], group["ir"], group["jc"] = np.ones(1), np.zeros(1, dtype=int), np.array([0, 1])
        with pytest.raises(MatrixFileError, match="damaged"):
            read_matrix(tmp_path / name)


@pytest.mark.parametrize(
    ("line", "scales"),
    [
        ("PARAM,CM2,0.5", True),
        ("PARAM   CK2     2.-1", True),
        ("M2GG = 0.5*KAA", True),
        ("K2GG = KAA", False),
        ("PARAM,CM2,1.0", False),
        ("PARAM,WTMASS,.00259", False),  # Nastran does not apply it to M2GG
    ],
)
def test_factors_of_direct_matrices_are_refused(tmp_path, line, scales):
    header = "DMIG    KAA            0       6       2       0\n"
    (tmp_path / "k.bdf").write_text(f"{line}\nBEGIN BULK\n{header}DMIG,KAA,1,1,,1,1,2.5\n")
    if scales:
        with pytest.raises(MatrixFileError, match="scales its matrices"):
            read_matrix(tmp_path / "k.bdf")
    else:
        assert read_matrix(tmp_path / "k.bdf").matrix.toarray().tolist() == [[2.5]]

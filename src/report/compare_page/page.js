// A picture split against the reference, a click to flip, and tables that sort by a click on a heading.
for (const input of document.querySelectorAll('.split + input')) {
    const split = input.previousElementSibling;
    input.addEventListener('input', () => split.style.setProperty('--at', input.value + '%'));
    split.addEventListener('click', () => split.classList.toggle('flipped'));
}
for (const head of document.querySelectorAll('th[data-key]')) {
    head.addEventListener('click', () => {
        const body = head.closest('table').tBodies[0];
        const column = head.cellIndex;
        const value = row => {
            const text = row.cells[column].dataset.value ?? row.cells[column].textContent;
            return text === '' ? Infinity : isNaN(text) ? text : Number(text);
        };
        const sign = head.dataset.order === 'up' ? -1 : 1;
        head.dataset.order = sign === 1 ? 'up' : 'down';
        const rows = [...body.rows];
        rows.sort((a, b) => {
            const [x, y] = [value(a), value(b)];
            return sign * (typeof x === 'number' && typeof y === 'number' ? x - y : String(x).localeCompare(String(y)));
        });
        body.append(...rows);
    });
}
